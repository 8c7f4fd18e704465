# A plan seen from above: the planned chaser and the predicted target with 3 σ ellipses.
#
#     gnuplot -c plan.gp FOLDER [svg|png|pdf]
#
# of: plan
# needs: planned_chaser.csv predicted_target.csv

here = ""; do for [i = 1:strlen(ARG0)] { if (ARG0[i:i] eq "/") { here = ARG0[1:i] } }
call here."common.gp" ARG0 ARG1 ARG2 ARG3

east = ned ? 3 : 2; north = ned ? 2 : 3
sigma_east = ned ? 10 : 9; sigma_north = ned ? 9 : 10 # columns of predicted_target.csv
stats file('planned_chaser.csv') skip 1 using east:north name 'chaser' nooutput
stats file('predicted_target.csv') skip 1 using east:north name 'target' nooutput
x_min = min(chaser_min_x, target_min_x); x_max = max(chaser_max_x, target_max_x)
y_min = min(chaser_min_y, target_min_y); y_max = max(chaser_max_y, target_max_y)

call here.'map.gp' scenario.': plan seen from above'
every_ellipse = chaser_records / 10 + 1
most = 0.4 * max(x_max - x_min, y_max - y_min) # larger ellipses would hide the trajectories
shown(x) = max(column(sigma_east), column(sigma_north)) < most ? x : NaN
plot file('predicted_target.csv') skip 1 every every_ellipse using (shown(column(east))):north:(2 * column(sigma_east)):(2 * column(sigma_north)) with ellipses fc rgb pale fs transparent solid 0.25 noborder title 'target, 3 σ', \
  file('predicted_target.csv') skip 1 using east:north with linespoints pt 7 ps 0.3 lc rgb vermilion title 'predicted target', \
  file('planned_chaser.csv') skip 1 using east:north with linespoints pt 7 ps 0.3 lc rgb blue title 'planned chaser', \
  file('planned_chaser.csv') skip 1 every ::0::0 using east:north with points pt 6 ps 1.2 lw 1.5 lc rgb 'black' title 'start', \
  file('predicted_target.csv') skip 1 every ::0::0 using east:north with points pt 6 ps 1.2 lw 1.5 lc rgb 'black' notitle
