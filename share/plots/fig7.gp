# Figure 7 of the paper: relative position errors of raw measurements, Mode A and Mode B over time, with 3 σ bounds and
# measurement times.
#
#     gnuplot -c fig7.gp FOLDER [svg|png|pdf]
#
# of: paper
# needs: fig7.csv

here = ""; do for [i = 1:strlen(ARG0)] { if (ARG0[i:i] eq "/") { here = ARG0[1:i] } }
call here."common.gp" ARG0 ARG1 ARG2 ARG3

set datafile columnheaders
data = file('fig7.csv')
call here.'figure.gp' '560' 'docking_a: error of the relative position'
set multiplot
set key maxrows 2
set tmargin at screen (1 - 92.0 / height)
set bmargin at screen (120.0 / height)
set logscale y
set ylabel 'error [m]'
set format x ''
call here.'time.gp' data
set yrange [0.01:100]
plot data using (since(column('t'))):'a_three_sigma_m' with lines dt 2 lc rgb blue title 'Mode A, 3 σ', \
  data using (since(column('t'))):'b_three_sigma_m' with lines dt 2 lc rgb vermilion title 'Mode B, 3 σ', \
  data using (since(column('t'))):'raw_error_m' with points pt 7 ps 0.25 lc rgb grey title 'raw', \
  data using (since(column('t'))):'a_error_m' with lines lw 1.5 lc rgb blue title 'Mode A', \
  data using (since(column('t'))):'b_error_m' with lines lw 1.5 lc rgb vermilion title 'Mode B'
unset label 1
unset logscale y
unset ylabel
unset key
unset grid
eval show_time
set tmargin at screen (1 - (height - 105.0) / height)
set bmargin at screen (60.0 / height)
set yrange [-0.6:1.6]
set ytics ('position' 0, 'pose' 1)
row(type) = type eq 'position' ? 0 : type eq 'pose' ? 1 : NaN
plot data using (since(column('t'))):(row(strcol('type'))) with points pt 9 ps 0.4 lc rgb green
unset multiplot
