# Errors of the chaser's position and orientation by component over time with 3 σ bounds; without truth the bounds
# alone. Grey areas are times without GPS.
#
#     gnuplot -c navigation_errors.gp FOLDER [svg|png|pdf]
#
# of: navigate
# needs: errors.csv gps_outages.csv

here = ""; do for [i = 1:strlen(ARG0)] { if (ARG0[i:i] eq "/") { here = ARG0[1:i] } }
call here."common.gp" ARG0 ARG1 ARG2 ARG3

errors = file('errors.csv')
set datafile columnheaders
array label[6] = ['x [m]', 'y [m]', 'z [m]', 'roll [°]', 'pitch [°]', 'yaw [°]']
array error[6] = ['error_x_m', 'error_y_m', 'error_z_m', 'error_rx_deg', 'error_ry_deg', 'error_rz_deg']
array bound[6] = ['three_sigma_x_m', 'three_sigma_y_m', 'three_sigma_z_m', 'three_sigma_rx_deg', 'three_sigma_ry_deg', 'three_sigma_rz_deg']
array bounded[6]
array limit[6]
array cut[6]
shown = ''; truth = 0; bands = 0
do for [i = 1:6] {
  if (exists('e_records')) { undefine e_* }
  if (exists('b_records')) { undefine b_* }
  stats errors using (abs(column(error[i]))) name 'e' nooutput
  stats errors using (abs(column(bound[i]))) name 'b' nooutput
  bounded[i] = exists('b_max')
  if (exists('e_max') || bounded[i]) {
    shown = shown.sprintf('%d ', i)
    if (exists('e_max')) { truth = 1 }
    if (bounded[i]) { bands = 1 }
    e_most = exists('e_max') ? e_max : 0
    most = max(e_most, bounded[i] ? b_max : 0)
    # The range covers all errors and 90 % of the bounds. The widest bounds occur before the heading is observable.
    call here.'quantile.gp' errors bound[i] '0.9'
    most_shown = max(1e-9, max(1.1 * e_most, 1.3 * quantile))
    limit[i] = most > most_shown ? most_shown : 1.05 * max(most, 1e-9)
    cut[i] = most > limit[i]
  }
}
if (shown eq '') { exit }
call here.'time.gp' errors
outages = ''; n_outages = 0
stats file('gps_outages.csv') using (n_outages = n_outages + 1, outages = outages.sprintf("set object %d rectangle from %.17g,graph 0 to %.17g,graph 1 fillcolor rgb '#f2f2f2' fillstyle solid 1 noborder behind;", n_outages, since(column('from')), since(column('to'))), 1) nooutput

every_row = time_records / 5000 + 1 # enough for the resolution of the figure
call here.'panels.gp' sprintf('%d', words(shown)) '150' scenario.(truth ? ': errors by component' : ': uncertainty by component')
shown_bound(i) = !bounded[i] || empty(bound[i]) || column(bound[i]) >= 1e300 ? 0 : column(bound[i]) # no band where nothing is estimated
set style fill transparent solid 0.13 noborder
set format x ''
eval outages
do for [n = 1:words(shown)] {
  i = int(word(shown, n))
  if (n == 2) { unset label 1; unset key }
  if (n == words(shown)) { eval show_time }
  # Tics at 1, 2 or 5 times a power of ten, one to three on either side of zero.
  decade = 10 ** floor(log10(limit[i] / 1.5))
  step = 5 * decade <= limit[i] / 1.5 ? 5 * decade : 2 * decade <= limit[i] / 1.5 ? 2 * decade : decade
  set ytics step
  set yrange [-limit[i]:limit[i]]
  set ylabel label[i]
  unset label 2
  if (cut[i]) { set label 2 'cut' at graph 0.995,0.9 right textcolor rgb '#777777' }
  band = bands ? "errors every every_row using (since(column('t'))):(-shown_bound(i)):(shown_bound(i)) with filledcurves lc rgb blue title '±3 σ'" : 'NaN notitle'
  line = truth ? ", errors every every_row using (since(column('t'))):(column(error[i])) with lines lw 1.2 lc rgb vermilion title 'error'" : ''
  keys = n == 1 && n_outages > 0 ? ", keyentry with boxes fc rgb '#dddddd' fs solid 1 noborder title 'without GPS'" : ''
  eval 'plot '.band.line.keys
}
unset multiplot
