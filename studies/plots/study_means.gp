# Mean error of the relative position in a study's trials, by grid cell and model, with its 95 % confidence interval: at
# keyframes with a USBL fix, with an optical one, and within gaps.
#
#     gnuplot -c study_means.gp FOLDER [svg|png]
#
# of: study
# needs: summary.csv

here = ""; do for [i = 1:strlen(ARG0)] { if (ARG0[i:i] eq "/") { here = ARG0[1:i] } }
call here."common.gp" ARG0 ARG1 ARG2 ARG3
call here."study.gp"

array metric[3] = ['usbl_position_m', 'optical_position_m', 'gated_position_m']
array what[3] = ['USBL', 'optical', 'gated']
array colour[3] = [vermilion, blue, '#555555']
call here.'figure.gp' sprintf('%d', 110 + 22 * groups) 'Mean error of the relative position over trials, and its 95 % confidence interval [m]'
set multiplot
unset key
set tmargin at screen (1 - 62.0 / height)
set bmargin at screen (40.0 / height)
width = (0.97 - names_to) / 3
do for [m = 1:3] {
  if (exists('s_records')) { undefine s_* }
  set autoscale xy # or stats would see what is in range alone
  stats summary using (strcol('metric') eq metric[m] ? column('low') : NaN):(column('high')) name 's' nooutput
  if (!exists('s_min_x')) { continue }
  span = max(s_max_y - max(0, s_min_x), 1e-9)
  set xrange [max(0, s_min_x - 0.1 * span):s_max_y + 0.1 * span]
  set yrange [groups + 0.6:0.4]
  set xtics 10 ** floor(log10(span)) * (span > 5 * 10 ** floor(log10(span)) ? 5 : span > 2 * 10 ** floor(log10(span)) ? 2 : 0.5)
  set lmargin at screen (names_to + (m - 1) * width + 0.012)
  set rmargin at screen (names_to + m * width - 0.012)
  set title what[m] offset 0,-0.6
  if (m == 1) { set ytics noenhanced } else { unset label 1; set ytics 1; set format y '' }
  points = "summary using (strcol('metric') eq metric[m] ? column('mean') : NaN):(row(0)):'low':'high' with xerrorbars pt 7 ps 0.7 lw 1.5 lc rgb colour[m]"
  eval 'plot '.(m == 1 ? named_rows.', ' : '').points
}
unset multiplot
