# Mean errors of position and orientation of each motion model, by type of keyframe. Models that were refused, or did not
# converge, are marked.
#
#     gnuplot -c models.gp FOLDER [svg|png]
#
# of: models
# needs: models.csv

here = ""; do for [i = 1:strlen(ARG0)] { if (ARG0[i:i] eq "/") { here = ARG0[1:i] } }
call here."common.gp" ARG0 ARG1 ARG2 ARG3

models = tabbed('models.csv')
set datafile separator "\t"
set datafile columnheaders
rows = 0
stats models using (rows = rows + 1, scenario = strcol('scenario'), 1) nooutput
array error[8] = ['usbl_position_error_m', 'optical_position_error_m', 'gated_position_error_m', 'all_position_error_m', 'usbl_orientation_error_deg', 'optical_orientation_error_deg', 'gated_orientation_error_deg', 'all_orientation_error_deg']
array there[8]
array least[2] = [1e300, 1e300]
array most[2] = [0, 0]
do for [i = 1:8] {
  if (exists('e_records')) { undefine e_* }
  stats models using (column(error[i])) name 'e' nooutput
  there[i] = exists('e_records')
  if (there[i]) {
    panel = i <= 4 ? 1 : 2
    least[panel] = min(least[panel], max(e_min, 1e-9)); most[panel] = max(most[panel], max(e_max, 1e-9))
  }
}
if (!there[4] && !there[8]) { exit }

call here.'figure.gp' sprintf('%d', 150 + 22 * rows) scenario.': mean errors by motion model'
left = 0.33
set multiplot
set tmargin at screen (1 - 62.0 / height)
set bmargin at screen (62.0 / height)
set yrange [rows - 0.4:-0.6] # the first one on top
set logscale x
set grid
name_of(model, status) = status eq 'converged' ? model : model.' ('.status.')'
do for [panel = 0:1] {
  first = 4 * panel
  if (!there[first + 4]) { continue }
  lower = 0.8 * least[panel + 1]; upper = 1.25 * most[panel + 1]
  set xrange [lower:upper]
  tics = ''; decade = 10 ** floor(log10(lower))
  while (decade < upper) {
    do for [m in (upper < 10 * lower ? '1 1.5 2 3 4 5 7' : upper < 100 * lower ? '1 2 5' : '1')] {
      if (m * decade >= lower && m * decade <= upper) { tics = tics.(tics eq '' ? '' : ', ').sprintf('%g', m * decade) }
    }
    decade = 10 * decade
  }
  eval 'set xtics ('.tics.')'
  set lmargin at screen (panel == 0 ? left : 0.5 * (1 + left) + 0.015)
  set rmargin at screen (panel == 0 ? 0.5 * (1 + left) - 0.015 : 0.97)
  set xlabel panel == 0 ? 'position error [m]' : 'orientation error [°]'
  if (panel == 1) { unset label 1; unset key; set ytics 1; set format y '' }
  command = panel == 0 ? "models using (NaN):0:ytic(name_of(strcol('model'), strcol('status'))) notitle" : 'NaN notitle'
  if (there[first + 3]) { command = command.", models using (column(error[first + 3])):0 with points pt 7 ps 0.7 lc rgb grey title 'gated'" }
  if (there[first + 1]) { command = command.", models using (column(error[first + 1])):0 with points pt 9 ps 0.9 lc rgb vermilion title 'USBL'" }
  if (there[first + 2]) { command = command.", models using (column(error[first + 2])):0 with points pt 7 ps 0.7 lc rgb blue title 'optical'" }
  if (there[first + 4]) { command = command.", models using (column(error[first + 4])):0 with points pt 2 ps 0.9 lw 2 lc rgb 'black' title 'all'" }
  if (panel == 0) { set ytics noenhanced }
  eval 'plot '.command
}
unset multiplot
