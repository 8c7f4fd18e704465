# Sets quantile to the value below which SHARE of the absolute values of a column are, 0 of none.
#
#     call 'quantile.gp' FILE COLUMN SHARE [but]     (but: without the rows whose column "type" says this)

quantile = 0
quantile_file = ARG1; quantile_column = ARG2; quantile_but = ARG4; quantile_share = ARG3 + 0
# What is left out counts nothing, before all others: gnuplot does not sort what is not a number.
quantile_value(x, type) = x == x && (quantile_but eq '' || type ne quantile_but) ? x : -1
if (exists('quantile_of_records')) { undefine quantile_of_* }
stats quantile_file using (quantile_value(abs(column(quantile_column)), quantile_but eq '' ? '' : strcol('type'))) name 'quantile_of' nooutput
if (exists('quantile_of_max')) {
  if (quantile_of_max >= 0) {
    set table $quantile_sorted
    plot quantile_file using (quantile_x = quantile_value(abs(column(quantile_column)), quantile_but eq '' ? '' : strcol('type'))):(quantile_x >= 0) smooth cnormal
    unset table
    undefine quantile_of_*
    set datafile separator whitespace
    set datafile nocolumnheaders
    stats $quantile_sorted using (column(1) >= 0 && column(2) >= quantile_share - 1e-9 ? column(1) : NaN) name 'quantile_of' nooutput
    set datafile separator comma
    set datafile columnheaders
    if (exists('quantile_of_min')) { quantile = quantile_of_min }
  }
}
