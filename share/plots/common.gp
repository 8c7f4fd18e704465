# Common part of all plot scripts: arguments, colours, and scenario name and frame from summary.json.
#
#     call 'common.gp' SCRIPT FOLDER FORMAT OUTPUT
#
# Sets: name (of the script), folder, format (svg, png or pdf), output (file; empty for standard output), cells (separator
# of CSV files), scenario, ned (1 if the frame of the files is NED-FRD).
#
# OUTPUT is '-' if Tandem draws: the picture then goes to standard output, and FOLDER has tab-separated copies of the
# files, since gnuplot cuts quoted cells at commas.
#
# Scripts use neither system() nor file names that start with '<', and they never evaluate text from files, which may
# come from others.

name = ARG1
do for [i = 1:strlen(ARG1)] { if (ARG1[i:i] eq '/') { name = ARG1[i + 1:*] } }
if (strlen(name) > 3) { if (name[strlen(name) - 2:*] eq '.gp') { name = name[1:strlen(name) - 3] } }
folder = ARG2 eq '' ? '.' : ARG2
if (folder[1:1] eq '<' || folder[1:1] eq '|') { folder = './'.folder } # gnuplot would execute it as a command
format = ARG3 eq 'png' || ARG3 eq 'pdf' ? ARG3 : 'svg'
output = ARG4 eq '-' ? '' : folder.'/'.name.'.'.format
cells = ARG4 eq '-' ? "\t" : ','
file(what) = folder.'/'.what

# Palette that suits all kinds of colour vision (Okabe & Ito 2008).
blue = '#0072B2'; vermilion = '#D55E00'; orange = '#E69F00'; sky_blue = '#56B4E9'
green = '#009E73'; purple = '#CC79A7'; grey = '#999999'; pale = '#c4c4c4'
pale_blue = '#9ccbe8'; pale_vermilion = '#f2bd92'

# Whether a cell is empty. Its number is NaN in gnuplot 5; gnuplot 6 omits rows of which an expression takes it.
empty(name) = strcol(name) eq '' ? 1 : column(name) != column(name)
max(a, b) = a > b ? a : b
min(a, b) = a < b ? a : b

call here.'terminal.gp'

scenario = ''; ned = 0
set datafile separator ':'
stats file('summary.json') using (strcol(1) eq 'scenario' ? (scenario = strcol(2), 1) : strcol(1) eq 'frame' ? (ned = strcol(2) eq 'NED-FRD', 1) : 0) nooutput
set datafile separator cells
