# Trajectories of chaser and target seen from above, with measured target positions and, if available, truth.
#
#     gnuplot -c trajectories.gp FOLDER [svg|png|pdf]
#
# of: estimate track
# needs: chaser.tum target.tum

here = ""; do for [i = 1:strlen(ARG0)] { if (ARG0[i:i] eq "/") { here = ARG0[1:i] } }
call here."common.gp" ARG0 ARG1 ARG2 ARG3

east = ned ? 3 : 2; north = ned ? 2 : 3
set datafile separator whitespace
stats file('chaser.tum') using east:north name 'chaser' nooutput
stats file('target.tum') using east:north name 'target' nooutput
stats file('chaser_truth.tum') using 1 name 'truth' nooutput
x_min = chaser_min_x; x_max = chaser_max_x; y_min = chaser_min_y; y_max = chaser_max_y
if (exists('target_records')) {
  x_min = min(x_min, target_min_x); x_max = max(x_max, target_max_x)
  y_min = min(y_min, target_min_y); y_max = max(y_max, target_max_y)
}
# Measured positions by sensor, as far as there are colours.
colours = orange.' '.sky_blue.' '.green.' '.purple.' '.grey
array sensor[words(colours)]
sensors = 0; fixes = ''; keys = ''
set datafile separator cells
place(name) = sum [i = 1:sensors] (sensor[i] eq name ? i : 0)
stats file('target_fixes.csv') skip 1 using (name_here = strcol(2), new = place(name_here) == 0 && sensors < words(colours), sensors = sensors + new, new ? (sensor[sensors] = name_here, 1) : 1) nooutput
do for [i = 1:sensors] {
  eval sprintf('set table $fixes_%d', i)
  plot file('target_fixes.csv') skip 1 using (column(east + 2)):(column(north + 2)) with table if (strcol(2) eq sensor[i])
  unset table
  fixes = fixes.sprintf("$fixes_%d using 1:2 with points pt 7 ps %g lc rgb '%s' notitle, ", i, i == 1 ? 0.3 : 0.2, word(colours, i))
  keys = keys.sprintf("keyentry with points pt 7 ps 0.5 lc rgb '%s' title sensor[%d].' fix' noenhanced, ", word(colours, i), i)
}
set datafile separator whitespace

call here.'map.gp' scenario.': trajectories seen from above'
every_chaser = chaser_records / 5000 + 1 # enough for the resolution of the figure
every_target = exists('target_records') ? target_records / 5000 + 1 : 1
last_target = exists('target_records') ? target_records - 1 : 0
truth = exists('truth_records') ? sprintf("file('chaser_truth.tum') every %d using east:north with lines lw 4 lc rgb pale_blue title 'true chaser', file('target_truth.tum') every %d using east:north with lines lw 4 lc rgb pale_vermilion title 'true target', ", every_chaser, every_target) : ''
plot @truth @fixes \
  file('chaser.tum') every every_chaser using east:north with lines lw 1.2 lc rgb blue title 'chaser', \
  file('target.tum') every every_target using east:north with lines lw 1.2 lc rgb vermilion title 'target', \
  @keys \
  file('chaser.tum') every ::0::0 using east:north with points pt 6 ps 1.2 lw 1.5 lc rgb 'black' title 'start', \
  file('target.tum') every ::0::0 using east:north with points pt 6 ps 1.2 lw 1.5 lc rgb 'black' notitle, \
  file('chaser.tum') every ::(chaser_records - 1) using east:north with points pt 5 ps 0.9 lc rgb 'black' title 'end', \
  file('target.tum') every ::last_target using east:north with points pt 5 ps 0.9 lc rgb 'black' notitle
