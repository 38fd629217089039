# Eigenvalues over the transition corridor: make figures
set terminal svg size 860,420 dynamic font 'sans-serif,13' background rgb 'white'
set output 'docs/figures/corridor.svg'
set datafile separator ','
rows = "< sed -e 's/^h = //' -e 's/ m,/,/' build/corridor.csv"
set title 'Eigenvalues along the transition corridor, equation (16), reference gains'
set title font ',14'
set xlabel 'height h [m]   (nacelle tilt η and flight path γ fall from 90° to 0°)'
set ylabel 'real part of eigenvalues [1/s]'
set xrange [0:120]
set yrange [-1:0.25]
set key at graph 0.985, 0.05 right bottom box opaque samplen 1 height 0.3
set grid ytics lc rgb '#dddddd'
set xzeroaxis lt 1 lc rgb '#000000'
set arrow from 46.4356, graph 0 to 46.4356, graph 1 nohead dt 2 lc rgb '#555555'
set label 'η = 60°: the cyclic hands over to the elevator' at 56, 0.14 left tc rgb '#555555'
plot rows using (strcol(3) eq 'stable' ? $1 : NaN):4 with points pt 7 ps 0.45 lc rgb '#0072b2' \
       title 'of a stable condition', \
     rows using (strcol(3) eq 'unstable' ? $1 : NaN):4 with points pt 9 ps 0.8 lc rgb '#d55e00' \
       title 'of an unstable condition'
