# Opens a map with equal scales, east to the right and north up. It covers x_min to x_max and y_min to y_max with a
# margin and a limited aspect ratio.
#
#     call 'map.gp' TITLE

margin = 0.04 * max(x_max - x_min, y_max - y_min) + 0.5 # m
tall = max(y_max - y_min + 2 * margin, 0.3 * (x_max - x_min + 2 * margin))
wide = max(x_max - x_min + 2 * margin, 0.9 * tall)
call here.'figure.gp' sprintf('%d', int(0.8 * 560 * tall / wide) + 156) ARG1
set tmargin at screen (1 - 96.0 / height)
set bmargin at screen (60.0 / height)
set size ratio -1
set xrange [(x_min + x_max - wide) / 2:(x_min + x_max + wide) / 2]
set yrange [(y_min + y_max - tall) / 2:(y_min + y_max + tall) / 2]
set xlabel ned ? 'y (east) [m]' : 'x [m]'
set ylabel ned ? 'x (north) [m]' : 'y [m]'
