# Figure 6 of the paper: both modes and the truth from above, with close-ups where each mode has its largest error.
#
#     gnuplot -c fig6.gp FOLDER [svg|png|pdf]
#
# of: paper
# needs: fig6.csv

here = ""; do for [i = 1:strlen(ARG0)] { if (ARG0[i:i] eq "/") { here = ARG0[1:i] } }
call here."common.gp" ARG0 ARG1 ARG2 ARG3

set datafile columnheaders
data = file('fig6.csv')
array at_x[2]; array at_y[2]
array mode[2] = ['a', 'b']
array worst[2] = [0, 0]
around = 25 # m
# The second close-up does not overlap the first.
do for [k = 1:2] {
  stats data using (e = column(mode[k].'_error_m'), x = column('truth_x_m'), y = column('truth_y_m'), \
    e > worst[k] && (k == 1 || (x - at_x[1]) ** 2 + (y - at_y[1]) ** 2 > 4 * around ** 2) \
    ? (worst[k] = e, at_x[k] = x, at_y[k] = y, 1) : 0) nooutput
}
call here.'figure.gp' '620' 'docking_a: the target from above'
set multiplot
set size ratio -1
set lmargin at screen 0.14; set rmargin at screen 0.94
set tmargin at screen 0.88; set bmargin at screen 0.5
set xlabel 'x [m]' offset 0,0.5
set ylabel 'y [m]'
do for [k = 1:2] { set object k rectangle center at_x[k],at_y[k] size 2*around,2*around fs empty border lc rgb grey }
plot data using 'truth_x_m':'truth_y_m' with lines lw 2 lc rgb pale title 'truth', \
  data using 'a_x_m':'a_y_m' with lines lc rgb blue title 'Mode A', \
  data using 'b_x_m':'b_y_m' with lines lc rgb vermilion title 'Mode B'
unset object 1
unset object 2
unset label 1
unset key
set tmargin at screen 0.41; set bmargin at screen 0.07
do for [k = 1:2] {
  set lmargin at screen (k == 1 ? 0.14 : 0.58)
  set rmargin at screen (k == 1 ? 0.5 : 0.94)
  set xrange [at_x[k] - around:at_x[k] + around]
  set yrange [at_y[k] - around:at_y[k] + around]
  plot data using 'truth_x_m':'truth_y_m' with lines lw 2 lc rgb pale, \
    data using 'a_x_m':'a_y_m' with linespoints pt 7 ps 0.25 lc rgb blue, \
    data using 'b_x_m':'b_y_m' with linespoints pt 7 ps 0.25 lc rgb vermilion
}
unset multiplot
