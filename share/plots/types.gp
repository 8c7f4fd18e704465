# Points of errors.csv by the measurement at the keyframe, and their legend. Both have only the types that occur.
#
#     call 'types.gp' FILE
#
# `since` is that of time.gp. Sets: points_of(e) (plot elements that show the expression e over time), type_keys (legend, for the end of a plot
# command).

types_file = ARG1
array type_name[4] = ['none', 'partial', 'position', 'pose'] # later ones are drawn on top
array type_point[4] = ['pt 7 ps 0.3 lc rgb grey', 'pt 5 ps 0.35 lc rgb green', 'pt 9 ps 0.55 lc rgb vermilion', 'pt 7 ps 0.3 lc rgb blue']
array type_key[4] = ['pt 7 ps 0.6 lc rgb grey', 'pt 5 ps 0.6 lc rgb green', 'pt 9 ps 0.8 lc rgb vermilion', 'pt 7 ps 0.6 lc rgb blue']
array type_there[4]
do for [k = 1:4] {
  if (exists('type_of_records')) { undefine type_of_* }
  stats types_file using (strcol('type') eq type_name[k] ? 1 : NaN) name 'type_of' nooutput
  type_there[k] = exists('type_of_records')
}
type_points(e, k) = type_there[k] ? sprintf(", types_file using (since(column('t'))):(strcol('type') eq '%s' ? %s : NaN) with points %s notitle", type_name[k], e, type_point[k]) : ''
points_of(e) = (type_points(e, 1).type_points(e, 2).type_points(e, 3).type_points(e, 4))[3:*]
type_keys = ''
do for [k in '3 4 2 1'] {
  if (type_there[k + 0]) { type_keys = type_keys.sprintf(", keyentry with points %s title '%s'", type_key[k + 0], type_name[k + 0]) }
}
