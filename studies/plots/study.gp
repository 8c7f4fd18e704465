# What the plots of a study share: its tables, cells apart at tabs, since the names of models have commas; and the names of
# what is compared, in the order of summary.csv: group[1] to group[groups], of grid cell, model and solver.
#
#     call 'study.gp'

set datafile separator "\t"
set datafile columnheaders

summary = tabbed('summary.csv')
groups = 0; first_solver = ''; solvers = 1; last = ''
told(cell, model, solver) = (cell eq '' ? '' : cell.': ').model.(solvers > 1 ? ', '.solver : '')
stats summary using (first_solver = first_solver eq '' ? strcol('solver') : first_solver, solvers = strcol('solver') eq first_solver ? solvers : 2, 1) nooutput
array group[1000]
stats summary using (this = told(strcol('cell'), strcol('model'), strcol('solver')), groups = this eq last ? groups : groups + 1, group[groups] = this, last = this, 1) nooutput
row_of(cell, model, solver) = sum [i = 1:groups] (group[i] eq told(cell, model, solver) ? i : 0)
row(x) = row_of(strcol('cell'), strcol('model'), strcol('solver')) # of a line of a table; x is not read

longest = 0
do for [i = 1:groups] { longest = max(longest, strlen(group[i])) }
names_to = min(0.5, 0.03 + 0.0106 * longest) # where the names of groups end, as a share of the width
# What names the rows of a plot, without points.
named_rows = "summary using (NaN):(row(0)):ytic(told(strcol('cell'), strcol('model'), strcol('solver'))) notitle"
