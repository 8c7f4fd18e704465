# Mean position and orientation errors of each motion model by the measurement at the keyframe. Labels of models that did not converge
# show their status.
#
#     gnuplot -c models.gp FOLDER [svg|png|pdf]
#
# of: models
# needs: models.csv

here = ""; do for [i = 1:strlen(ARG0)] { if (ARG0[i:i] eq "/") { here = ARG0[1:i] } }
call here."common.gp" ARG0 ARG1 ARG2 ARG3

models = file('models.csv')
set datafile columnheaders
rows = 0
stats models using (rows = rows + 1, scenario = strcol('scenario'), 1) nooutput
types = 'none partial position pose all' # later ones are drawn on top
array style[5] = ['pt 7 ps 0.7 lc rgb grey', 'pt 5 ps 0.6 lc rgb green', 'pt 9 ps 0.9 lc rgb vermilion', 'pt 7 ps 0.7 lc rgb blue', "pt 2 ps 0.9 lw 2 lc rgb 'black'"]
array error[10]
do for [i = 1:5] { error[i] = 'at_'.word(types, i).'_error_m'; error[5 + i] = 'at_'.word(types, i).'_orientation_deg' }
array there[10]
array least[2] = [1e300, 1e300]
array most[2] = [0, 0]
do for [i = 1:10] {
  if (exists('e_records')) { undefine e_* }
  stats models using (column(error[i])) name 'e' nooutput
  there[i] = exists('e_records')
  if (there[i]) {
    panel = i <= 5 ? 1 : 2
    least[panel] = min(least[panel], max(e_min, 1e-9)); most[panel] = max(most[panel], max(e_max, 1e-9))
  }
}
if (!there[5] && !there[10]) { exit }

call here.'figure.gp' sprintf('%d', 150 + 22 * rows) scenario.': mean errors by motion model' 'page'
left = 0.33
set multiplot
set tmargin at screen (1 - 62.0 / height)
set bmargin at screen (62.0 / height)
set yrange [rows - 0.4:-0.6] # first model on top
set logscale x
set grid
name_of(model, status) = status eq 'converged' ? model : model.' ('.status.')'
do for [panel = 0:1] {
  first = 5 * panel
  if (!there[first + 5]) { continue }
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
  do for [i = 1:5] {
    if (there[first + i]) { command = command.sprintf(", models using (column(error[%d])):0 with points %s notitle", first + i, style[i]) }
  }
  do for [i in '3 4 2 1 5'] {
    if (panel == 0 && there[i + 0]) { command = command.sprintf(", keyentry with points %s title '%s'", style[i + 0], word(types, i + 0)) }
  }
  if (panel == 0) { set ytics noenhanced }
  eval 'plot '.command
}
unset multiplot
