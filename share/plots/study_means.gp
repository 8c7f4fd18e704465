# Mean relative position error of a study by grid cell and model, with 95 % confidence intervals, by the
# measurement at the keyframe.
#
#     gnuplot -c study_means.gp FOLDER [svg|png|pdf]
#
# of: study
# needs: summary.csv

here = ""; do for [i = 1:strlen(ARG0)] { if (ARG0[i:i] eq "/") { here = ARG0[1:i] } }
call here."common.gp" ARG0 ARG1 ARG2 ARG3
call here."study.gp"

types = ''
do for [type in 'position pose partial none'] {
  if (exists('s_records')) { undefine s_* }
  stats summary using (strcol('metric') eq 'at_'.type.'_error_m' ? column('mean') : NaN) name 's' nooutput
  if (exists('s_records')) { types = types.type.' ' }
}
if (types eq '') { exit }
panels = words(types)
colour(type) = type eq 'position' ? vermilion : type eq 'pose' ? blue : type eq 'partial' ? green : '#555555'
call here.'figure.gp' sprintf('%d', 110 + 22 * groups) 'Mean relative position error over trials with 95 % confidence interval [m]' 'page'
set multiplot
unset key
set tmargin at screen (1 - 62.0 / height)
set bmargin at screen (40.0 / height)
width = (0.97 - names_to) / panels
do for [m = 1:panels] {
  metric = 'at_'.word(types, m).'_error_m'; shade = colour(word(types, m))
  if (exists('s_records')) { undefine s_* }
  set autoscale xy # stats ignores values outside the range
  stats summary using (strcol('metric') eq metric ? column('low') : NaN):(column('high')) name 's' nooutput
  span = max(s_max_y - max(0, s_min_x), 1e-9)
  set xrange [max(0, s_min_x - 0.1 * span):s_max_y + 0.1 * span]
  set yrange [groups + 0.6:0.4]
  set xtics 10 ** floor(log10(span)) * (span > 5 * 10 ** floor(log10(span)) ? 5 : span > 2 * 10 ** floor(log10(span)) ? 2 : 0.5)
  set lmargin at screen (names_to + (m - 1) * width + 0.012)
  set rmargin at screen (names_to + m * width - 0.012)
  set title word(types, m) offset 0,-0.6
  if (m == 1) { set ytics noenhanced } else { unset label 1; set ytics 1; set format y '' }
  points = "summary using (strcol('metric') eq metric ? column('mean') : NaN):(row(0)):'low':'high' with xerrorbars pt 7 ps 0.7 lw 1.5 lc rgb shade"
  eval 'plot '.(m == 1 ? named_rows.', ' : '').points
}
unset multiplot
