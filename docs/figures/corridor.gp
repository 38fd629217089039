# Eigenvalues over the transition corridor: make figures
load 'docs/figures/style.gp'
set output 'docs/figures/corridor.svg'
map = 'build/corridor.csv'
set xlabel 'height h [m]   (nacelle tilt η and flight path γ fall from 90° to 0°)'
set ylabel 'real part of the eigenvalues [1/s]'
set xrange [0:120]
set yrange [-1:0.4]
set xzeroaxis lt 1 lw 1.2 lc rgb '#1b1f24'
set arrow from 46.4356, graph 0 to 46.4356, graph 1 nohead ls 6
set label 'η = 60°: handover from the cyclic to the elevator' at 57, 0.3 left tc rgb muted
# A branch is broken at the handover, where the trim jumps.
re(k) = column(22 + 2 * k)
branch(k) = (column(2) > 46.4356 && column(2) < 46.6) ? NaN : re(k)
plot map using 2:(strcol(7) eq 'unstable' ? 0.4 : -1) every ::1 with filledcurves y1=-1 \
       fs solid noborder lc rgb unstable title 'unstable', \
     for [k = 0:5] map using 2:(branch(k)) every ::1 with lines ls 1 \
       title (k ? '' : 'real parts of the eigenvalues')
