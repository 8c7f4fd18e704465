# Figure 3 of the paper: panels side by side, seen from above. Each pose is an arrow along its x axis and a tick along
# its y axis, projected into the plane.
#
#     gnuplot -c fig3.gp FOLDER [svg|png|pdf]
#
# of: paper
# needs: fig3.csv

here = ""; do for [i = 1:strlen(ARG0)] { if (ARG0[i:i] eq "/") { here = ARG0[1:i] } }
call here."common.gp" ARG0 ARG1 ARG2 ARG3

poses = file('fig3.csv')
set datafile columnheaders
radius = 2.0 # m, of the arc
arrow = 0.62; tick = 0.25 # m, lengths of the axes of a pose
# First two columns of a rotation matrix, projected into the plane.
xx(y, z) = 1 - 2 * (y ** 2 + z ** 2)
xy(x, y, z, w) = 2 * (x * y + z * w)
yx(x, y, z, w) = 2 * (x * y - z * w)
yy(x, z) = 1 - 2 * (x ** 2 + z ** 2)
q(which, axis) = column(which.'q'.axis)
x_of(which) = column(which.'x_m')
y_of(which) = column(which.'y_m')
x_axis_x(which) = arrow * xx(q(which, 'y'), q(which, 'z'))
x_axis_y(which) = arrow * xy(q(which, 'x'), q(which, 'y'), q(which, 'z'), q(which, 'w'))
y_axis_x(which) = tick * yx(q(which, 'x'), q(which, 'y'), q(which, 'z'), q(which, 'w'))
y_axis_y(which) = tick * yy(q(which, 'x'), q(which, 'z'))

# Range of all panels [m]: the circle and all poses with their arrows, plus a margin.
x_min = -radius; x_max = radius; y_min = -radius; y_max = radius
extend(x, y) = (x_min = min(x_min, x), x_max = max(x_max, x), y_min = min(y_min, y), y_max = max(y_max, y))
panels = 0
array title[20]; array start_off[20]; array end_off[20]; array iterations[20]
do for [k = 1:20] { start_off[k] = 0; end_off[k] = 0 }
stats poses using (n = column('panel'), panels = max(panels, n), title[n] = strcol('title'), start_off[n] = max(start_off[n], column('start_off_arc_m')), end_off[n] = max(end_off[n], column('off_arc_m')), iterations[n] = column('iterations'), extend(x_of('start_'), y_of('start_')), extend(x_of(''), y_of('')), extend(x_of('start_') + x_axis_x('start_'), y_of('start_') + x_axis_y('start_')), extend(x_of('') + x_axis_x(''), y_of('') + x_axis_y('')), 1) nooutput
x_min = x_min - 0.25; x_max = x_max + 0.25; y_min = y_min - 0.25; y_max = y_max + 0.25

panel = 400; gap = 30; left = 76; above = 40; below = 114 # pixels
width = left + panels * (panel + gap)
height = above + floor(panel * (y_max - y_min) / (x_max - x_min) + 0.5) + below
eval opened(width, height, page_inches)
set multiplot
set parametric
set samples 361
set size ratio -1
unset key
set style textbox opaque noborder margins 0.5,0.5
set border 3 lc rgb '#555555'
set tics nomirror tc rgb '#333333' 1
set grid lc rgb '#eeeeee' lt 1
set xrange [x_min:x_max]
set yrange [y_min:y_max]
set xlabel 'x [m]'
set ylabel 'y [m]'
set tmargin at screen (1 - 1.0 * above / height)
set bmargin at screen (1.0 * below / height)
here_is(which, n) = column('panel') == n && (which eq 'given' ? column('given') == 1 : column('given') == 0)
power_of_ten(x) = x > 0 ? sprintf('%.0f×10^{%d}', x / 10 ** floor(log10(x)), floor(log10(x))) : '0'
array look[3] = ['start', 'given', 'solved']
array prefix[3] = ['start_', '', '']
array point[3] = [8, 5, 7]
array shade[3] = [orange, 'black', blue]
do for [n = 1:panels] {
  set lmargin at screen ((left + (n - 1.0) * (panel + gap)) / width)
  set rmargin at screen ((left + (n - 1.0) * (panel + gap) + panel) / width)
  set title title[n] offset 0,-0.4
  set label 1 sprintf("%.1f m → %s m\noff the arc, in %d iterations", start_off[n], power_of_ten(end_off[n]), iterations[n]) at 0,(-0.3 * radius) center tc rgb '#333333'
  plot [0:2*pi] radius * cos(t), radius * sin(t) with lines lw 3 lc rgb pale notitle, \
    poses using (column('panel') == n ? x_of('start_') : NaN):(y_of('start_')):(x_of('') - x_of('start_')):(y_of('') - y_of('start_')) with vectors nohead dt 2 lw 1.3 lc rgb grey notitle, \
    poses using (column('panel') == n ? 0.75 * x_of('') : NaN):(0.75 * y_of('')):(sprintf('T_%d', column('pose'))) with labels boxed tc rgb '#333333' notitle, \
    for [k = 1:3] poses using (here_is(look[k], n) ? x_of(prefix[k]) : NaN):(y_of(prefix[k])):(x_axis_x(prefix[k])):(x_axis_y(prefix[k])) with vectors head filled size 0.16,20 lw 2 lc rgb shade[k] notitle, \
    for [k = 1:3] poses using (here_is(look[k], n) ? x_of(prefix[k]) : NaN):(y_of(prefix[k])):(y_axis_x(prefix[k])):(y_axis_y(prefix[k])) with vectors nohead lw 2 lc rgb shade[k] notitle, \
    for [k = 1:3] poses using (here_is(look[k], n) ? x_of(prefix[k]) : NaN):(y_of(prefix[k])) with points pt point[k] ps 0.8 lw 2 lc rgb shade[k] notitle
  unset ylabel
  set format y ''
}

# The key is a separate plot below all panels.
reset
set lmargin at screen 0
set rmargin at screen 1
set bmargin at screen 0
set tmargin at screen (44.0 / height)
unset border
unset tics
set key center center horizontal maxrows 1 reverse Left samplen 2 width 1
plot [0:1][0:1] NaN with lines lw 3 lc rgb pale title 'constant twist', \
  NaN with points pt 8 ps 0.9 lw 2 lc rgb orange title 'initial guess', \
  NaN with points pt 5 ps 0.9 lw 2 lc rgb 'black' title 'given pose', \
  NaN with points pt 7 ps 0.9 lw 2 lc rgb blue title 'solved pose'
unset multiplot
