# Opens a figure in the common style: title and key above on the left, light axes.
#
#     call 'figure.gp' HEIGHT TITLE        (900 pixels wide)

height = ARG1 + 0
eval sprintf("set terminal %s size 900,%d font 'Helvetica,13' background rgb 'white'", format eq 'png' ? 'pngcairo' : format, height)
if (output ne '') { set output output }
set label 1 ARG2 at screen 0.02,screen (1 - 20.0 / height) noenhanced
set key at screen 0.015,screen (1 - 32.0 / height) left top horizontal maxrows 1 reverse Left samplen 1.5 font ',12'
set lmargin at screen 0.11
set rmargin at screen 0.97
set border 3 lc rgb '#555555'
set tics nomirror tc rgb '#333333'
set grid lc rgb '#e8e8e8' lt 1
