# Prepares the time axis of the column `t` of a file: UTC if its stamps are seconds since 1970, else hours, minutes and
# seconds since the first.
#
#     call 'time.gp' FILE
#
# Sets: since(t) (time on the axis), the range and tics of x, show_time (statements that label the axis, for eval).

stats ARG1 using 't' name 'time' nooutput
utc = time_min > 3e8
time_start = utc ? 0 : time_min
since(t) = t - time_start
time_step = 1
do for [s in '2 5 10 20 30 60 120 300 600 1200 1800 3600 7200 14400 28800 86400'] {
  if ((time_max - time_min) / time_step > 5) { time_step = s + 0 }
}
set xtics time_step
set xrange [since(time_min):since(time_max)]
show_time = utc ? "set format x '%H:%M:%S' timedate; set xlabel 'UTC, ".strftime('%Y-%m-%d', time_min)."'" : "set format x '%tH:%tM:%tS' timedate; set xlabel 'time since start [h:min:s]'"
