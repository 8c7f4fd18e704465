# Sets `quantile` to the SHARE quantile of the absolute values of a column; 0 if there are no values. Interpolates
# linearly between order statistics (Hyndman & Fan 1996, type 7).
#
#     call 'quantile.gp' FILE COLUMN SHARE [EXCEPT]     (EXCEPT: ignores rows whose column "type" has this value)

quantile = 0
quantile_file = ARG1; quantile_column = ARG2; quantile_except = ARG4; quantile_share = ARG3 + 0
# Ignored and infinite values become -1, below all others, with weight 0: gnuplot cannot sort NaN.
quantile_value(x, type) = x < 1e300 && (quantile_except eq '' || type ne quantile_except) ? x : -1
if (exists('quantile_of_records')) { undefine quantile_of_* }
stats quantile_file using (quantile_value(abs(column(quantile_column)), quantile_except eq '' ? '' : strcol('type'))) name 'quantile_of' nooutput
if (exists('quantile_of_max')) {
  if (quantile_of_max >= 0) {
    set table $quantile_counts  # how many values are at most x
    plot quantile_file using (quantile_x = quantile_value(abs(column(quantile_column)), quantile_except eq '' ? '' : strcol('type'))):(quantile_x >= 0) smooth cumulative
    unset table
    set datafile separator whitespace
    set datafile nocolumnheaders
    stats $quantile_counts using 2 name 'quantile_of' nooutput
    quantile_at = quantile_share * (quantile_of_max - 1)
    quantile_rank = floor(quantile_at) + 1
    stats $quantile_counts using (column(1) >= 0 && column(2) > quantile_rank - 0.5 ? column(1) : NaN) name 'quantile_of' nooutput
    quantile = quantile_of_min
    quantile_share = quantile_at - floor(quantile_at)
    if (quantile_share > 1e-9) {
      stats $quantile_counts using (column(1) >= 0 && column(2) > quantile_rank + 0.5 ? column(1) : NaN) name 'quantile_of' nooutput
      quantile = quantile + quantile_share * (quantile_of_min - quantile)
    }
    set datafile separator cells
    set datafile columnheaders
  }
}
