# Magnitude of the relative position and orientation error of the target at each keyframe.
#
#     gnuplot -c error_norms.gp FOLDER [svg|png|pdf]
#
# of: estimate track
# needs: errors.csv

here = ""; do for [i = 1:strlen(ARG0)] { if (ARG0[i:i] eq "/") { here = ARG0[1:i] } }
call here."common.gp" ARG0 ARG1 ARG2 ARG3

errors = file('errors.csv')
set datafile columnheaders
stats errors using 'position_error_m' name 'position' nooutput
stats errors using 'orientation_error_deg' name 'orientation' nooutput
if (!exists('position_records')) { exit }
both = exists('orientation_records')

call here.'types.gp' errors
call here.'panels.gp' (both ? '2' : '1') (both ? '270' : '280') scenario.': error at each keyframe, by its measurement'
points = points_of("at_least(e)")
at_least(e) = column(e) < 1e300 ? max(column(e), 1e-9) : NaN
call here.'time.gp' errors
set logscale y
set format y '%g'
set ylabel 'position error [m]'
e = 'position_error_m'
if (both) { set format x '' } else { eval show_time }
eval 'plot '.points.type_keys
if (both) {
  unset label 1
  unset key
  eval show_time
  unset logscale y
  set yrange [0:*]
  set ylabel 'orientation error [°]'
  e = 'orientation_error_deg'
  eval 'plot '.points
}
unset multiplot
