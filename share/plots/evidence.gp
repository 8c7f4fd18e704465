# Logarithm of the evidence along each calibrated standard deviation, with the others at their calibrated values. One
# panel per parameter.
#
#     gnuplot -c evidence.gp FOLDER [svg|png|pdf]
#
# of: calibrate
# needs: parameters.csv evidence.csv

here = ""; do for [i = 1:strlen(ARG0)] { if (ARG0[i:i] eq "/") { here = ARG0[1:i] } }
call here."common.gp" ARG0 ARG1 ARG2 ARG3

parameters = file('parameters.csv'); evidence = file('evidence.csv')
set datafile columnheaders
n = 0
stats parameters using (n = n + 1, 1) nooutput
stats evidence using 'sigma' name 'e' nooutput
if (n == 0 || !exists('e_records')) { exit }
array title[n]; array given[n]; array found[n]; array identifiable[n]
i = 0
stats parameters using (i = i + 1, title[i] = strcol('parameter'), given[i] = column('given'), found[i] = column('found'), identifiable[i] = column('identifiable'), 1) nooutput

columns = 4
rows = (n + columns - 1) / columns
call here.'figure.gp' sprintf('%d', 100 + 175 * rows) 'Log evidence along each standard deviation, relative to the calibrated one' 'page'
set multiplot
# The legend is a separate plot across all panels.
unset border; unset tics
plot [0:1] [0:1] NaN with lines lw 2 lc rgb blue title 'evidence', NaN with lines lc rgb vermilion dt 2 title 'given', \
  NaN with lines lc rgb blue title 'calibrated'
unset label 1
set key off
set border 3
set yrange [-8:*]
set ytics nomirror tc rgb '#333333'
set xtics nomirror tc rgb '#333333' offset 0,0.3
set logscale x
set format x '%.2g'
do for [k = 1:n] {
  row = (k - 1) / columns; place = (k - 1) % columns
  set lmargin at screen (45.0 + 215 * place) / 900
  set rmargin at screen (45.0 + 215 * place + 180) / 900
  set tmargin at screen (1 - (85.0 + 175 * row) / height)
  set bmargin at screen (1 - (85.0 + 175 * row + 115) / height)
  set title title[k].(identifiable[k] == 1 ? '' : ' (not identifiable)') noenhanced offset 0,-0.7
  undefine s_*
  stats evidence using (strcol('parameter') eq title[k] ? column('sigma') : NaN) name 's' nooutput
  if (exists('s_min')) {
    low = min(s_min, given[k]) / 1.1; high = max(s_max, given[k]) * 1.1
    set xrange [low:high]
    set xtics autofreq
    if (high < 8 * low) { set xtics (sprintf('%.2g', low * 1.1) low * 1.1, sprintf('%.2g', sqrt(low * high)) sqrt(low * high), sprintf('%.2g', high / 1.1) high / 1.1) }
    set arrow 1 from given[k], graph 0 to given[k], graph 1 nohead lc rgb vermilion dt 2
    set arrow 2 from found[k], graph 0 to found[k], graph 1 nohead lc rgb blue
    plot evidence using (strcol('parameter') eq title[k] ? column('sigma') : NaN):'log_evidence' with lines lw 2 lc rgb blue
  }
}
unset multiplot
