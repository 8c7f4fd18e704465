# The chaser's trajectory seen from above, with GPS fixes and, if available, truth.
#
#     gnuplot -c navigation.gp FOLDER [svg|png|pdf]
#
# of: navigate
# needs: chaser.tum

here = ""; do for [i = 1:strlen(ARG0)] { if (ARG0[i:i] eq "/") { here = ARG0[1:i] } }
call here."common.gp" ARG0 ARG1 ARG2 ARG3

east = ned ? 3 : 2; north = ned ? 2 : 3
stats file('chaser_fixes.csv') skip 1 using 3 name 'fixes' nooutput
if (exists('fixes_records')) {
  set table $fixes
  plot file('chaser_fixes.csv') skip 1 using (column(east + 1)):(column(north + 1)) with table
  unset table
}
set datafile separator whitespace
stats file('chaser.tum') using east:north name 'chaser' nooutput
stats file('chaser_truth.tum') using east:north name 'truth' nooutput
x_min = chaser_min_x; x_max = chaser_max_x; y_min = chaser_min_y; y_max = chaser_max_y
if (exists('truth_records')) {
  x_min = min(x_min, truth_min_x); x_max = max(x_max, truth_max_x)
  y_min = min(y_min, truth_min_y); y_max = max(y_max, truth_max_y)
}

call here.'map.gp' scenario.': trajectory seen from above'
set xlabel ned ? 'y (east) [m]' : 'x (east) [m]'
set ylabel ned ? 'x (north) [m]' : 'y (north) [m]'
stride = chaser_records / 5000 + 1 # enough for the resolution of the figure
truth = exists('truth_records') ? "file('chaser_truth.tum') every stride using east:north with lines lw 4 lc rgb pale_blue title 'truth', " : ''
fixes = exists('fixes_records') ? "$fixes using 1:2 with points pt 7 ps 0.35 lc rgb orange notitle, keyentry with points pt 7 ps 0.6 lc rgb orange title 'GPS fix', " : ''
plot @truth @fixes \
  file('chaser.tum') every stride using east:north with lines lw 1.4 lc rgb blue title 'estimate', \
  file('chaser.tum') every ::0::0 using east:north with points pt 6 ps 1.2 lw 1.5 lc rgb 'black' title 'start', \
  file('chaser.tum') every ::(chaser_records - 1) using east:north with points pt 5 ps 0.9 lc rgb 'black' title 'end'
