# Figure 1 of the paper: online estimates of both modes through a gap, seen from above.
#
#     gnuplot -c fig1.gp FOLDER [svg|png|pdf]
#
# of: paper
# needs: fig1.csv

here = ""; do for [i = 1:strlen(ARG0)] { if (ARG0[i:i] eq "/") { here = ARG0[1:i] } }
call here."common.gp" ARG0 ARG1 ARG2 ARG3

set datafile columnheaders
data = file('fig1.csv')
call here.'figure.gp' '370' 'docking_a: online estimates through the longest gap'
set size ratio -1
set tmargin at screen (1 - 78.0 / height)
set bmargin at screen (60.0 / height)
set xlabel 'x [m]'
set ylabel 'y [m]'
seen(x) = strcol('type') eq 'none' ? NaN : x
plot data using 'truth_x_m':'truth_y_m' with lines lw 2 lc rgb pale title 'truth', \
  data using (seen(column('truth_x_m'))):'truth_y_m' with points pt 7 ps 0.4 lc rgb green title 'with a measurement', \
  data using 'a_x_m':'a_y_m' with linespoints pt 7 ps 0.3 lc rgb blue title 'Mode A', \
  data using 'b_x_m':'b_y_m' with linespoints pt 7 ps 0.3 lc rgb vermilion title 'Mode B'
