# Common part of the plots of a study. Sets `summary` and the names of the compared groups in the order
# of summary.csv: group[1] to group[groups], of grid cell, model and solver.
#
#     call 'study.gp'

set datafile columnheaders

summary = file('summary.csv')
groups = 0; first_solver = ''; solvers = 1; last = ''
group_name(cell, model, solver) = (cell eq '' ? '' : cell.': ').model.(solvers > 1 ? ', '.solver : '')
stats summary using (first_solver = first_solver eq '' ? strcol('solver') : first_solver, solvers = strcol('solver') eq first_solver ? solvers : 2, 1) nooutput
array group[1000]
stats summary using (this = group_name(strcol('cell'), strcol('model'), strcol('solver')), groups = this eq last ? groups : groups + 1, group[groups] = this, last = this, 1) nooutput
row_of(cell, model, solver) = sum [i = 1:groups] (group[i] eq group_name(cell, model, solver) ? i : 0)
row(x) = row_of(strcol('cell'), strcol('model'), strcol('solver')) # row number of the group of a table row; x is unused

longest = 0
do for [i = 1:groups] { longest = max(longest, strlen(group[i])) }
names_to = min(0.5, 0.03 + 0.0106 * longest) # right end of the group names, as a share of the width
# Plot element that labels the rows with the group names and draws no points.
named_rows = "summary using (NaN):(row(0)):ytic(group_name(strcol('cell'), strcol('model'), strcol('solver'))) notitle"
