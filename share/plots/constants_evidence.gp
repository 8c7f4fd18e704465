# Logarithm of the evidence along each constant systematic error, with all other parameters at their optimum. One panel
# per constant.
#
#     gnuplot -c constants_evidence.gp FOLDER [svg|png|pdf]
#
# of: calibrate
# needs: constants.csv constants_evidence.csv

here = ""; do for [i = 1:strlen(ARG0)] { if (ARG0[i:i] eq "/") { here = ARG0[1:i] } }
call here."common.gp" ARG0 ARG1 ARG2 ARG3

constants = file('constants.csv'); evidence = file('constants_evidence.csv')
set datafile columnheaders
n = 0; several = 0; first = ''
stats constants using (n = n + 1, first = (first eq '' ? strcol('scenario') : first), several = several || strcol('scenario') ne first, 1) nooutput
array of[n]; array title[n]; array found[n]; array error[n]
i = 0
stats constants using (i = i + 1, of[i] = strcol('scenario').','.strcol('constant'), title[i] = strcol('constant').(several ? ' of '.strcol('scenario') : ''), found[i] = column('value'), error[i] = column('sigma'), 1) nooutput
# Only scalar constants have points.
shown = ''; panels = 0
do for [k = 1:n] {
  undefine s_*
  stats evidence using (strcol('scenario').','.strcol('constant') eq of[k] ? column('value') : NaN) name 's' nooutput
  if (exists('s_records')) { if (s_records > 1) { shown = shown.sprintf('%d ', k); panels = panels + 1 } }
}
if (panels == 0) { exit }

columns = 4
rows = (panels + columns - 1) / columns
call here.'figure.gp' sprintf('%d', 100 + 175 * rows) 'Log evidence along each constant, relative to the estimate' 'page'
set multiplot
# The legend is a separate plot across all panels.
unset border; unset tics
plot [0:1] [0:1] NaN with lines lw 2 lc rgb blue title 'evidence', NaN with lines lc rgb vermilion dt 2 title 'zero', \
  NaN with lines lc rgb blue title 'estimate'
unset label 1
set key off
set border 3
set yrange [-8:*]
set ytics nomirror tc rgb '#333333'
set xtics nomirror tc rgb '#333333' offset 0,0.3
set format x '%.2g'
do for [p = 1:panels] {
  k = int(word(shown, p))
  row = (p - 1) / columns; place = (p - 1) % columns
  set lmargin at screen (45.0 + 215 * place) / 900
  set rmargin at screen (45.0 + 215 * place + 180) / 900
  set tmargin at screen (1 - (85.0 + 175 * row) / height)
  set bmargin at screen (1 - (85.0 + 175 * row + 115) / height)
  set title title[k] noenhanced offset 0,-0.7
  undefine s_*
  stats evidence using (strcol('scenario').','.strcol('constant') eq of[k] ? column('value') : NaN) name 's' nooutput
  low = min(s_min, 0); high = max(s_max, 0); margin = 0.05 * (high - low)
  set xrange [low - margin:high + margin]
  step = (high - low) / 3; set xtics step
  set arrow 1 from 0, graph 0 to 0, graph 1 nohead lc rgb vermilion dt 2
  set arrow 2 from found[k], graph 0 to found[k], graph 1 nohead lc rgb blue
  plot evidence using (strcol('scenario').','.strcol('constant') eq of[k] ? column('value') : NaN):'log_evidence' with linespoints lw 2 pt 7 ps 0.4 lc rgb blue
}
unset multiplot
