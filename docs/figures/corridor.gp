# Eigenvalues over the transition corridor: make figures
set terminal svg size 860,420 dynamic font 'sans-serif,13' background rgb 'white'
set output 'docs/figures/corridor.svg'
set datafile separator ','
map = 'build/corridor.csv'
set title 'Closed-loop eigenvalues along the transition corridor, reference gains'
set title font ',14'
set xlabel 'height h [m]   (nacelle tilt η and flight path γ fall from 90° to 0°)'
set ylabel 'real part of the eigenvalues [1/s]'
set xrange [0:120]
set yrange [-1:0.4]
set key at graph 0.985, 0.05 right bottom box opaque samplen 2 height 0.3
set grid ytics lc rgb '#dddddd'
set xzeroaxis lt 1 lc rgb '#000000'
set arrow from 46.4356, graph 0 to 46.4356, graph 1 nohead dt 2 lc rgb '#555555'
set label 'η = 60°: handover from the cyclic to the elevator' at 57, 0.3 left tc rgb '#555555'
# A branch is broken at the handover, where the trim jumps.
re(k) = column(22 + 2 * k)
branch(k) = (column(2) > 46.4356 && column(2) < 46.6) ? NaN : re(k)
plot map using 2:(strcol(7) eq 'unstable' ? 0.4 : -1) every ::1 with filledcurves y1=-1 \
       fs solid 0.35 noborder lc rgb '#f0b090' title 'unstable', \
     for [k = 0:5] map using 2:(branch(k)) every ::1 with lines lw 2 lc rgb '#0072b2' \
       title (k ? '' : 'eigenvalues, tracked')
