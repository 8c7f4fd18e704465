# Trajectories of chaser and target seen from above, where measurements put the target, and the truth where there is one.
#
#     gnuplot -c trajectories.gp FOLDER [svg|png]
#
# of: estimate track
# needs: chaser.tum target.tum

here = ""; do for [i = 1:strlen(ARG0)] { if (ARG0[i:i] eq "/") { here = ARG0[1:i] } }
call here."common.gp" ARG0 ARG1 ARG2 ARG3

set datafile separator ', ' # of both kinds of files
east = ned ? 3 : 2; north = ned ? 2 : 3
stats file('chaser.tum') using east:north name 'chaser' nooutput
stats file('target.tum') using east:north name 'target' nooutput
stats file('chaser_truth.tum') using 1 name 'truth' nooutput
x_min = chaser_min_x; x_max = chaser_max_x; y_min = chaser_min_y; y_max = chaser_max_y
if (exists('target_records')) {
  x_min = min(x_min, target_min_x); x_max = max(x_max, target_max_x)
  y_min = min(y_min, target_min_y); y_max = max(y_max, target_max_y)
}
usbl = 0; optical = 0
stats file('target_fixes.csv') skip 1 using (strcol(2) eq 'usbl' ? (usbl = 1) : (optical = 1)) nooutput

call here.'map.gp' scenario.': trajectories seen from above'
every_chaser = chaser_records / 5000 + 1 # a figure shows no more
every_target = exists('target_records') ? target_records / 5000 + 1 : 1
last_target = exists('target_records') ? target_records - 1 : 0
truth = exists('truth_records') ? sprintf("file('chaser_truth.tum') every %d using east:north with lines lw 4 lc rgb pale title 'truth', file('target_truth.tum') every %d using east:north with lines lw 4 lc rgb pale notitle, ", every_chaser, every_target) : ''
fixes = usbl ? "file('target_fixes.csv') skip 1 using (strcol(2) eq 'usbl' ? column(east + 1) : NaN):(column(north + 1)) with points pt 7 ps 0.3 lc rgb orange notitle, " : ''
fixes = fixes.(optical ? "file('target_fixes.csv') skip 1 using (strcol(2) eq 'optical' ? column(east + 1) : NaN):(column(north + 1)) with points pt 7 ps 0.2 lc rgb sky_blue notitle, " : '')
keys = usbl ? "keyentry with points pt 7 ps 0.5 lc rgb orange title 'USBL fix', " : ''
keys = keys.(optical ? "keyentry with points pt 7 ps 0.5 lc rgb sky_blue title 'optical fix', " : '')
plot @truth @fixes \
  file('chaser.tum') every every_chaser using east:north with lines lw 1.2 lc rgb blue title 'chaser', \
  file('target.tum') every every_target using east:north with lines lw 1.2 lc rgb vermilion title 'target', \
  @keys \
  file('chaser.tum') every ::0::0 using east:north with points pt 6 ps 1.2 lw 1.5 lc rgb 'black' title 'start', \
  file('target.tum') every ::0::0 using east:north with points pt 6 ps 1.2 lw 1.5 lc rgb 'black' notitle, \
  file('chaser.tum') every ::(chaser_records - 1) using east:north with points pt 5 ps 0.9 lc rgb 'black' title 'end', \
  file('target.tum') every ::last_target using east:north with points pt 5 ps 0.9 lc rgb 'black' notitle
