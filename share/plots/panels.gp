# Opens a figure with stacked panels.
#
#     call 'panels.gp' PANELS PIXELS TITLE     (PIXELS: height of a panel and the space below it)

call here.'figure.gp' sprintf('%d', 135 + ARG1 * ARG2) ARG3
eval sprintf('set multiplot layout %d,1 margins 0.17,0.94,%g,%g spacing %g', ARG1 + 0, 60.0 / height, 1 - 75.0 / height, 28.0 / height)
