# Conversion corridor in level flight: make figures
set terminal svg size 860,460 dynamic font 'sans-serif,13' background rgb 'white'
set output 'docs/figures/envelope.svg'
set datafile separator ','
# One piece of border to a block of lines.
rows = "< awk -F, 'NR > 1 { if (piece != \"\" && $2 != piece) print \"\"; piece = $2; print }' build/envelope.csv"
set title 'Level flight within the limits: speed over nacelle tilt, reference aircraft'
set title font ',14'
set xlabel 'airspeed V [m/s]'
set ylabel 'nacelle tilt η [°]   (90° helicopter, 0° airplane)'
set xrange [0:30.5]
set yrange [0:92]
set ytics 15
set key at graph 0.985, 0.42 right top box opaque samplen 2 height 0.3
set grid lc rgb '#dddddd'
set arrow from graph 0, first 60 to graph 1, first 60 nohead dt 2 lc rgb '#555555'
set label 'η = 60°: the cyclic hands over to the elevator' at 11.5, 57 left tc rgb '#555555'
set label 'no trim' at 2.2, 15 left tc rgb '#555555'
set label 'no trim' at 14.2, 62 left tc rgb '#555555' font ',11'
set label 'no trim' at 0.05, 56 left tc rgb '#555555' font ',10'
piece(name, x) = strcol(3) eq name ? x : NaN
plot rows using (piece('delta_e lower', $4)):5 with lines lw 2.5 lc rgb '#0072b2' \
       title 'elevator at its lower limit', \
     rows using (piece('delta_e upper', $4)):5 with lines lw 2.5 dt '-' lc rgb '#0072b2' \
       title 'elevator at its upper limit', \
     rows using (piece('a1s lower', $4)):5 with lines lw 2.5 lc rgb '#009e73' \
       title 'cyclic at its lower limit', \
     rows using (piece('theta0 upper', $4)):5 with lines lw 2.5 lc rgb '#d55e00' \
       title 'full thrust', \
     rows using (piece('fold', $4)):5 with lines lw 1.2 lc rgb '#555555' \
       title 'folds: three trims between them'
