# A plan over time: distances to the target and to the goal, and command (grey) and state (red) of each actuator.
#
#     gnuplot -c plan_commands.gp FOLDER [svg|png|pdf]
#
# of: plan
# needs: planned_chaser.csv commands.csv

here = ""; do for [i = 1:strlen(ARG0)] { if (ARG0[i:i] eq "/") { here = ARG0[1:i] } }
call here."common.gp" ARG0 ARG1 ARG2 ARG3

set datafile columnheaders
stats file('commands.csv') using 1 nooutput name 'commands'
actuators = (commands_columns - 1) / 2
call here.'panels.gp' sprintf('%d', actuators + 1) '130' scenario.': plan'
set format x ''
set ylabel 'distance [m]'
plot file('planned_chaser.csv') using 't':'distance_m' with lines lw 1.4 lc rgb blue title 'to the target', \
  file('planned_chaser.csv') using 't':'miss_m' with lines lw 1.4 lc rgb orange title 'to the goal'
unset label 1
unset key
do for [a = 1:actuators] {
  if (a == actuators) { set format x '%g'; set xlabel 't [s]' }
  actuator = ''
  stats file('commands.csv') using (actuator = columnhead(2 * a + 1), 1) every ::0::0 nooutput
  set ylabel actuator noenhanced
  plot file('commands.csv') using 1:(column(2 * a)) with steps lw 1.4 lc rgb grey, \
    file('commands.csv') using 1:(column(2 * a + 1)) with lines lw 1.2 lc rgb vermilion
}
unset multiplot
