# Mean NEES and NIS of a study divided by their degrees of freedom, by grid cell and model, with 95 % confidence
# intervals. Grey: 95 % band of the mean of a consistent estimator (χ²).
#
#     gnuplot -c study_consistency.gp FOLDER [svg|png|pdf]
#
# of: study
# needs: summary.csv consistency.csv

here = ""; do for [i = 1:strlen(ARG0)] { if (ARG0[i:i] eq "/") { here = ARG0[1:i] } }
call here."common.gp" ARG0 ARG1 ARG2 ARG3
call here."study.gp"

consistency = file('consistency.csv')
# NEES, then NIS of the first sensors.
metrics = 'nees_chaser nees_relative_position nees_relative_pose'; panels = 3
stats consistency using (m = strcol('metric'), new = m[1:4] eq 'nis_' && panels < 6 && strstrt(metrics.' ', ' '.m.' ') == 0, metrics = new ? metrics.' '.m : metrics, panels = panels + new, 1) nooutput
title_of(m) = m eq 'nees_chaser' ? 'NEES, chaser' : m eq 'nees_relative_position' ? 'relative position' : m eq 'nees_relative_pose' ? 'relative pose' : 'NIS, '.m[5:*]
stats consistency using (column('mean') / column('degrees')):(column('band_low') / column('degrees')) name 'all' nooutput
if (!exists('all_records')) { exit }
call here.'figure.gp' sprintf('%d', 110 + 22 * groups) 'NEES and NIS divided by their degrees of freedom; a consistent estimator has 1' 'page'
set multiplot
unset key
set tmargin at screen (1 - 62.0 / height)
set bmargin at screen (40.0 / height)
set yrange [groups + 0.6:0.4]
set logscale x
set xrange [0.7 * min(all_min_x, all_min_y):1.4 * max(all_max_x, 2)]
set xtics ('0.1' 0.1, '0.5' 0.5, '1' 1, '2' 2, '5' 5, '10' 10, '50' 50, '100' 100)
set arrow from 1, graph 0 to 1, graph 1 nohead lc rgb '#555555'
by(x) = strcol('metric') eq word(metrics, m) ? column(x) / column('degrees') : NaN
width = (0.97 - names_to) / panels
do for [m = 1:panels] {
  set lmargin at screen (names_to + (m - 1) * width + 0.01)
  set rmargin at screen (names_to + m * width - 0.01)
  set title title_of(word(metrics, m)) offset 0,-0.6 noenhanced
  if (m == 1) { set ytics noenhanced } else { unset label 1; set ytics 1; set format y '' }
  band = "consistency using (by('band_low')):(row(0)):(by('band_high') - by('band_low')):(0) with vectors nohead lw 9 lc rgb '#dddddd'"
  points = "consistency using (by('mean')):(row(0)):(by('low')):(by('high')) with xerrorbars pt 7 ps 0.7 lw 1.5 lc rgb blue"
  eval 'plot '.(m == 1 ? named_rows.', ' : '').band.', '.points
}
unset multiplot
