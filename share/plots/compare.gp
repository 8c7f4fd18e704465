# Relative distance of each solver's cost from the best one, against time, with a panel per problem.
#
#     gnuplot -c compare.gp FOLDER [svg|png|pdf]
#
# of: compare
# needs: compare.csv compare_progress.csv

here = ""; do for [i = 1:strlen(ARG0)] { if (ARG0[i:i] eq "/") { here = ARG0[1:i] } }
call here."common.gp" ARG0 ARG1 ARG2 ARG3

solves = file('compare.csv'); progress = file('compare_progress.csv')
none = 1e-10 # smallest relative distance on the logarithmic axis
set datafile columnheaders

# Problems and solvers in the order of the file. The best cost counts only solves without violated hard constraints.
problems = ''; solvers = ''; sizes = ''; n_best = 0
array best[100]
known(list, word) = strstrt(' '.list, ' '.word.' ') > 0
problem_of(n, constraints) = sprintf('%d:', n).constraints
place_of(list, what) = sum [k = 1:words(list)] (word(list, k) eq what ? k : 0)
key_of(problem, solver) = problem.'|'.solver
counts(constraints, violation) = constraints ne 'hard' || violation <= 1e-6
stats solves using (scenario = strcol('scenario'), problem = problem_of(column('keyframes'), strcol('constraints')), problems = known(problems, problem) ? problems : problems.problem.' ', solvers = known(solvers, strcol('solver')) ? solvers : solvers.strcol('solver').' ', size = sprintf('%d', column('keyframes')), sizes = known(sizes, size) ? sizes : sizes.size.' ', 1) nooutput
do for [p = 1:words(problems)] {
  if (exists('c_records')) { undefine c_* }
  stats solves using (problem_of(column('keyframes'), strcol('constraints')) eq word(problems, p) && counts(strcol('constraints'), column('violation')) ? column('cost') : NaN) name 'c' nooutput
  best[p] = exists('c_min') ? c_min : NaN
}
if (problems eq '') { exit }

# Each family of solvers has a colour, each member a dash pattern. NLopt has many members and gets thin lines.
ipopt = 'ipopt ipopt:gauss-newton ipopt:exact ipopt:limited-memory'
nlopt = ''
do for [s in solvers] { if (strstrt(s, 'nlopt:') == 1) { nlopt = nlopt.s.' ' } }
array nlopt_colour[4] = [sky_blue, grey, green, purple]
nlopt_place(s) = max(place_of(nlopt, s) - 1, 0)
colour(s) = s eq 'gauss-newton' ? blue : s eq 'augmented-lagrangian' ? vermilion : known(ipopt.' ', s) ? orange : nlopt_colour[nlopt_place(s) % 4 + 1]
dash(s) = known(ipopt.' ', s) ? place_of(ipopt, s) : strstrt(s, 'nlopt:') == 1 ? nlopt_place(s) / 4 + 1 : 1
thick(s) = s eq 'gauss-newton' || s eq 'augmented-lagrangian' ? 2.5 : known(ipopt.' ', s) ? 2.0 : 1.2

# End points of the solves, and which of them converged. Curves show the best cost so far; with hard constraints, the
# current cost, since a lower cost may violate them.
converged = ''
stats solves using (strcol('status') eq 'converged' ? (converged = converged.key_of(problem_of(column('keyframes'), strcol('constraints')), strcol('solver')).' ', 1) : 0) nooutput
distance(cost, best) = max(abs(cost - best) / max(abs(best), 1e-12), none)
so_far(key, constraints, cost) = (least = key ne current || constraints eq 'hard' ? cost : min(least, cost), current = key, least)
n_ends = 0; current = ''
stats progress using (key = key_of(problem_of(column('keyframes'), strcol('constraints')), strcol('solver')), n_ends = key ne current ? n_ends + 1 : n_ends, current = key, 1) nooutput
if (n_ends == 0) { exit }
array end_problem[n_ends]; array end_solver[n_ends]; array end_x[n_ends]; array end_y[n_ends]
n_ends = 0; current = ''
stats progress using (problem = problem_of(column('keyframes'), strcol('constraints')), key = key_of(problem, strcol('solver')), n_ends = key ne current ? n_ends + 1 : n_ends, y = distance(so_far(key, strcol('constraints'), column('cost')), best[max(1, place_of(problems, problem))]), end_problem[n_ends] = problem, end_solver[n_ends] = strcol('solver'), end_x[n_ends] = max(column('seconds'), 1e-5), end_y[n_ends] = y, 1) nooutput

rows = words(sizes)
columns = (words(problems) + rows - 1) / rows
width = 420 * columns + 420; height = 460 * rows + 40
eval opened(width, height, page_inches)
set multiplot
set label 1 scenario.': relative distance of the cost from the best one, against time' at screen (12.0 / width),screen (1 - 18.0 / height) noenhanced
set border 3 lc rgb '#555555'
set tics nomirror tc rgb '#333333'
set grid lc rgb '#e8e8e8' lt 1
set logscale xy
set format '10^{%T}'
set xlabel 'seconds' offset 0,0.4
set yrange [0.5 * none:*]
unset key

do for [p = 1:words(problems)] {
  this = word(problems, p)
  row = (p - 1) / columns; place = (p - 1) % columns
  set lmargin at screen ((420.0 * place + 115) / width)
  set rmargin at screen ((420.0 * (place + 1) - 5) / width)
  set tmargin at screen (1 - (460.0 * row + 105) / height)
  set bmargin at screen (1 - (460.0 * (row + 1) - 55) / height)
  constraints = this[strstrt(this, ':') + 1:*]
  size = this[1:strstrt(this, ':') - 1]
  set title size." keyframes,\n".(constraints eq 'off' ? 'no' : constraints).' constraints' noenhanced offset 0,-0.5
  if (place == 0) { set ylabel '|cost − best| / best' offset 1 } else { unset ylabel }
  marks = ''
  do for [k = 1:n_ends] {
    if (end_problem[k] eq this) {
      marks = marks.sprintf(", '+' every ::0::0 using (end_x[%d]):(end_y[%d]) with points pt %d ps 0.9 lw 1.5 lc rgb colour(end_solver[%d]) notitle", k, k, known(converged, key_of(this, end_solver[k])) ? 7 : 2, k)
    }
  }
  current = ''
  eval "plot for [s in solvers] progress using (problem_of(column('keyframes'), strcol('constraints')) eq this && strcol('solver') eq s ? max(column('seconds'), 1e-5) : NaN):(problem_of(column('keyframes'), strcol('constraints')) eq this && strcol('solver') eq s ? distance(so_far(s, constraints, column('cost')), best[p]) : NaN) with lines lw thick(s) dt dash(s) lc rgb colour(s) notitle".marks
  unset label 1
}

# Common key of all panels.
set lmargin at screen ((420.0 * columns + 10) / width)
set rmargin at screen 0.999
set tmargin at screen (1 - 40.0 / height)
set bmargin at screen 0.01
unset border
unset tics
unset grid
unset title
unset xlabel
unset ylabel
unset logscale
set xrange [0:1]
set yrange [0:1]
set key left top Left reverse samplen 2.5 noenhanced
drawn = ''
do for [s in solvers] { if ((sum [k = 1:n_ends] (end_solver[k] eq s)) > 0) { drawn = drawn.s.' ' } }
plot for [s in drawn] NaN with lines lw thick(s) dt dash(s) lc rgb colour(s) title s, \
  keyentry with points pt 7 ps 0.9 lc rgb '#555555' title 'converged', \
  keyentry with points pt 2 ps 0.9 lw 1.5 lc rgb '#555555' title 'not converged'
unset multiplot
