# Opens a figure in the common style: title and key above on the left, light axes. A column is 560 pixels wide, a page 900.
#
#     call 'figure.gp' HEIGHT TITLE [page]

height = ARG1 + 0
on_page = ARG3 eq 'page'
eval opened(on_page ? 900 : 560, height, on_page ? page_inches : column_inches)
set label 1 ARG2 at screen 0.02,screen (1 - 20.0 / height) noenhanced
set key at screen 0.015,screen (1 - 32.0 / height) left top horizontal maxrows (on_page ? 1 : 3) reverse Left samplen 1.2 width -1
set lmargin at screen (on_page ? 0.11 : 0.17)
set rmargin at screen 0.94
set border 3 lc rgb '#555555'
set tics nomirror tc rgb '#333333'
set grid lc rgb '#e8e8e8' lt 1
