# Terminal of all figures, which are laid out in pixels and drawn as wide as a column (3.5 in) or a page (7.2 in) of a
# paper, with text of 8 pt. Needs: format (svg, png or pdf), output (file; empty for standard output).

# Opens the terminal and the output: `eval opened(PIXELS, PIXELS, INCHES)`, width and height, and width of the figure.
column_inches = 3.5; page_inches = 7.2
opened(w, h, inches) = sprintf(format eq 'pdf' ? "set terminal pdfcairo size %gin,%gin font 'Helvetica,8' fontscale 0.75 linewidth 0.7 pointscale 0.7" : format eq 'png' ? "set terminal pngcairo size %.0f,%.0f font 'Helvetica,8' fontscale 3.125 linewidth 2 pointscale 2" : "set terminal svg size %.0f,%.0f font 'Helvetica,8' fontscale 1.333 linewidth 0.7", scale_of_format * inches, scale_of_format * inches * h / w)." background rgb 'white'; if (output ne '') { set output output }"
scale_of_format = format eq 'pdf' ? 1 : format eq 'png' ? 300 : 96 # pixels per inch
