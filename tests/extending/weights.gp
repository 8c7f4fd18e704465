# Weights of the measurements after robust losses, over time.
#
#     gnuplot -c weights.gp FOLDER [svg|png|pdf]
#
# of: estimate
# needs: weights.csv

here = ""; do for [i = 1:strlen(ARG0)] { if (ARG0[i:i] eq "/") { here = ARG0[1:i] } }
call here."common.gp" ARG0 ARG1 ARG2 ARG3

set datafile columnheaders
stats file('weights.csv') using 'weight' name 'weights' nooutput
if (!exists('weights_records')) { exit } # no measurement was down-weighted: no plot
call here.'figure.gp' '400' scenario.': weights'
set xlabel 't [s]'
set ylabel 'weight'
plot file('weights.csv') using 't':'weight' with points pt 7 ps 0.4 lc rgb blue title 'down-weighted'
