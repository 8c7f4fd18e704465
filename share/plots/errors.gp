# Signed errors of the relative pose by component over time with 3 σ bounds; without truth the bounds alone. Components
# without data, or always zero as in planar problems, are omitted. If σ spans decades, as between measured positions and
# measured poses, the scale is linear up to the smallest σ and logarithmic above.
#
#     gnuplot -c errors.gp FOLDER [svg|png|pdf]
#
# of: estimate track
# needs: errors.csv

here = ""; do for [i = 1:strlen(ARG0)] { if (ARG0[i:i] eq "/") { here = ARG0[1:i] } }
call here."common.gp" ARG0 ARG1 ARG2 ARG3

errors = file('errors.csv')
set datafile columnheaders
array label[4] = ['x [m]', 'y [m]', 'z [m]', 'yaw [°]']
array error[4] = ['error_x_m', 'error_y_m', 'error_z_m', 'error_rz_deg']
array bound[4] = ['three_sigma_x_m', 'three_sigma_y_m', 'three_sigma_z_m', 'three_sigma_rz_deg']
array bounded[4]
array limit[4]
array cut[4]
array linear[4]
shown = ''; truth = 0; bands = 0
do for [i = 1:4] {
  if (exists('e_records')) { undefine e_* }
  if (exists('b_records')) { undefine b_* }
  stats errors using (abs(column(error[i]))) name 'e' nooutput
  stats errors using (abs(column(bound[i]))) name 'b' nooutput
  e_most = exists('e_max') ? e_max : 0; b_most = exists('b_max') ? b_max : 0
  if (exists('e_max')) { truth = 1 }
  bounded[i] = exists('b_max')
  if (bounded[i]) { bands = 1 }
  most = max(e_most, b_most)
  if (most > 1e-12) {
    shown = shown.sprintf('%d ', i)
    # The range covers 99 % of the errors and most of the bounds. It ignores the widest ones, far from measurements.
    call here.'quantile.gp' errors error[i] '0.99'
    most_shown = max(quantile, 1e-9)
    except = 'none'
    call here.'quantile.gp' errors bound[i] '1' except
    if (quantile == 0) { except = '' }
    call here.'quantile.gp' errors bound[i] '0.95' except
    most_shown = max(most_shown, quantile)
    call here.'quantile.gp' errors bound[i] '0.05' except
    cut[i] = most > 1.3 * most_shown
    limit[i] = cut[i] ? 1.3 * most_shown : 1.05 * most
    linear[i] = quantile > 0 && most_shown > 8 * quantile ? quantile : 0
  }
}
if (shown eq '') { exit }

# Bounds of unobservable components are infinite, which gnuplot cannot draw. The band has no height
# for components that are not estimated, such as the yaw of a point: gnuplot would join it across missing rows.
shown_bound(i) = !bounded[i] || empty(bound[i]) ? 0 : column(bound[i]) > 10 * limit[i] ? 10 * limit[i] : column(bound[i])

call here.'types.gp' errors
call here.'panels.gp' sprintf('%d', words(shown)) '170' scenario.(truth ? ': error of the relative pose, by component' : ': uncertainty of the relative pose')
call here.'time.gp' errors
set style fill transparent solid 0.13 noborder
set format x ''
do for [n = 1:words(shown)] {
  i = int(word(shown, n))
  if (n == 2) { unset label 1; unset key }
  if (n == words(shown)) { eval show_time }
  note = cut[i] ? 'cut' : ''
  if (linear[i] > 0) {
    a = linear[i]
    set nonlinear y via asinh(y / a) inverse a * sinh(y)
    tics = '0'; last = 0; decade = 10 ** floor(log10(a))
    while (decade < limit[i]) {
      do for [m in '1 2 5'] {
        y = m * decade
        if (y < limit[i] && asinh(y / a) > last + 0.22 * asinh(limit[i] / a)) {
          tics = tics.sprintf(', %g, -%g', y, y)
          last = asinh(y / a)
        }
      }
      decade = 10 * decade
    }
    eval 'set ytics ('.tics.')'
    note = note eq '' ? 'log scale' : 'log scale, '.note
  } else {
    unset nonlinear y
    set ytics autofreq
  }
  set yrange [-limit[i]:limit[i]]
  set ylabel note eq '' ? label[i] : label[i]."\n{/*0.8 (".note.")}"
  band = bands ? "errors using (since(column('t'))):(-shown_bound(i)):(shown_bound(i)) with filledcurves lc rgb blue title '±3 σ'" : 'NaN notitle'
  points = truth ? ', '.points_of('column(error[i])') : ''
  keys = truth && n == 1 ? type_keys : ''
  eval 'plot '.band.points.keys
}
unset multiplot
