# The first run of a simulated rendezvous seen from above, with the phases of the chaser in different colours.
#
#     gnuplot -c rendezvous.gp FOLDER [svg|png|pdf]
#
# of: rendezvous
# needs: rendezvous.csv

here = ""; do for [i = 1:strlen(ARG0)] { if (ARG0[i:i] eq "/") { here = ARG0[1:i] } }
call here."common.gp" ARG0 ARG1 ARG2 ARG3

stats file('rendezvous.csv') skip 1 using 3:4 name 'chaser' nooutput
stats file('rendezvous.csv') skip 1 using 6:7 name 'target' nooutput
if (!exists('chaser_records')) { exit }
x_min = min(chaser_min_x, target_min_x); x_max = max(chaser_max_x, target_max_x)
y_min = min(chaser_min_y, target_min_y); y_max = max(chaser_max_y, target_max_y)
call here.'map.gp' scenario.', seen from above'
in_phase(phase) = strcol(2) eq phase ? column(4) : NaN
plot file('rendezvous.csv') skip 1 using 6:7 with lines lw 1.4 lc rgb vermilion title 'target', \
  file('rendezvous.csv') skip 1 using 3:4 with lines lw 0.8 lc rgb pale notitle, \
  file('rendezvous.csv') skip 1 using 3:(in_phase('searching')) with points pt 7 ps 0.5 lc rgb grey title 'searching', \
  file('rendezvous.csv') skip 1 using 3:(in_phase('approach')) with points pt 7 ps 0.5 lc rgb blue title 'approach', \
  file('rendezvous.csv') skip 1 using 3:(in_phase('docking')) with points pt 7 ps 0.5 lc rgb green title 'docking', \
  file('rendezvous.csv') skip 1 using 3:4 every ::0::0 with points pt 6 ps 1.2 lw 1.5 lc rgb 'black' title 'start', \
  file('rendezvous.csv') skip 1 using 6:7 every ::0::0 with points pt 6 ps 1.2 lw 1.5 lc rgb 'black' notitle
