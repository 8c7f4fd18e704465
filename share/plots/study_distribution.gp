# Cumulative distribution of the trials' mean relative position error by model, over the whole grid.
#
#     gnuplot -c study_distribution.gp FOLDER [svg|png|pdf]
#
# of: study
# needs: summary.csv trials.csv

here = ""; do for [i = 1:strlen(ARG0)] { if (ARG0[i:i] eq "/") { here = ARG0[1:i] } }
call here."common.gp" ARG0 ARG1 ARG2 ARG3
call here."study.gp"

trials = file('trials.csv')
array model[100]; array count[100]
models = 0
do for [i = 1:100] { model[i] = ''; count[i] = 0 }
known(name) = sum [i = 1:models] (model[i] eq name ? i : 0)
named(name, solver) = name.(solvers > 1 ? ', '.solver : '')
stats trials using (this = named(strcol('model'), strcol('solver')), k = known(this), models = k ? models : models + 1, k = k ? k : models, model[k] = this, counted = column('at_all_error_m'), count[k] = count[k] + (counted < 1e300), 1) nooutput
stats trials using 'at_all_error_m' name 'all' nooutput
if (!exists('all_records') || all_records < 2) { exit }
call here.'figure.gp' '420' 'Distribution of the mean position error of trials'
set key maxrows 3 noenhanced
set tmargin at screen (1 - (45.0 + 18 * min(3, models)) / height)
set xlabel 'mean relative position error [m]'
set ylabel 'share of trials'
set yrange [0:1.02]
array colour[8] = [blue, vermilion, green, orange, purple, sky_blue, 'black', grey]
# Trials of other models get weight 0 at the left end: NaN would interrupt a smoothed curve.
has(x, i) = x < 1e300 && named(strcol('model'), strcol('solver')) eq model[i]
x(i) = has(column('at_all_error_m'), i) ? column('at_all_error_m') : all_min
plot for [i = 1:models] trials using (x(i)):(has(column('at_all_error_m'), i) ? 1.0 / count[i] : 0) smooth cumulative with steps lw 2 lc rgb colour[(i - 1) % 8 + 1] title model[i]
