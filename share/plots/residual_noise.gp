# Standardised residuals of each sensor component with the given and the calibrated noise: histogram against the normal
# distribution, and autocorrelation.
#
#     gnuplot -c residual_noise.gp FOLDER [svg|png|pdf]
#
# of: calibrate
# needs: residuals.csv autocorrelation.csv

here = ""; do for [i = 1:strlen(ARG0)] { if (ARG0[i:i] eq "/") { here = ARG0[1:i] } }
call here."common.gp" ARG0 ARG1 ARG2 ARG3

residuals = file('residuals.csv'); correlations = file('autocorrelation.csv')
set datafile columnheaders
names = ''
stats correlations using (names = strstrt(' '.names, ' '.strcol('parameter').' ') > 0 ? names : names.strcol('parameter').' ', 1) nooutput
n = words(names)
if (n == 0) { exit }

call here.'figure.gp' sprintf('%d', 100 + 175 * n) 'Standardised residuals: histogram and autocorrelation' 'page'
set multiplot
bin = 0.25
placed(x) = bin * (floor(x / bin) + 0.5)
normal(x) = exp(-0.5 * x * x) / sqrt(2 * pi)
grey_box = "lc rgb '".pale."'"
set samples 200
do for [k = 1:n] {
  this = word(names, k)
  set tmargin at screen (1 - (80.0 + 175 * (k - 1)) / height)
  set bmargin at screen (1 - (80.0 + 175 * (k - 1) + 118) / height)
  set lmargin at screen 0.08
  set rmargin at screen 0.50
  set title this noenhanced offset 0,-0.7
  set xrange [-5:5]; set yrange [0:*]; set xtics 1 offset 0,0.4; set ytics autofreq
  if (k > 1) { unset key }
  array count[2] = [0, 0]
  stats residuals using (strcol('parameter') eq this ? (strcol('noise') eq 'given' ? (count[1] = count[1] + 1) : (count[2] = count[2] + 1), 1) : NaN) nooutput
  plot residuals using (strcol('parameter') eq this && strcol('noise') eq 'given' ? placed(column('standardised')) : NaN):(1.0 / (bin * max(count[1], 1))) smooth frequency with histeps lw 1.5 lc rgb vermilion title 'given noise', \
    '' using (strcol('parameter') eq this && strcol('noise') eq 'found' ? placed(column('standardised')) : NaN):(1.0 / (bin * max(count[2], 1))) smooth frequency with histeps lw 1.5 lc rgb blue title 'calibrated noise', \
    normal(x) with lines lc rgb '#555555' dt 2 title 'normal'
  unset label 1
  unset key
  set lmargin at screen 0.57
  set rmargin at screen 0.98
  set title 'lag [measurements]' offset 0,-0.8
  if (k > 1) { unset title }
  set xrange [0:25]; set yrange [-1:1]; set xtics 5; set ytics 0.5
  plot correlations using (strcol('parameter') eq this && strcol('noise') eq 'given' ? column('lag') : NaN):'correlation' with linespoints pt 7 ps 0.3 lc rgb vermilion, \
    '' using (strcol('parameter') eq this && strcol('noise') eq 'found' ? column('lag') : NaN):'correlation' with linespoints pt 7 ps 0.3 lc rgb blue, \
    0 with lines lc rgb '#555555' dt 2
}
unset multiplot
