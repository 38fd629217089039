# Conversion corridor in level flight: make figures
load 'docs/figures/style.gp'
set output 'docs/figures/envelope.svg'
# One piece of border to a block of lines.
rows = "< awk -F, 'NR > 1 { if (piece != \"\" && $2 != piece) print \"\"; piece = $2; print }' build/envelope.csv"
set xlabel 'airspeed V [m/s]'
set ylabel 'nacelle tilt η [°]   (90° helicopter, 0° airplane)'
set xrange [0:30.5]
set yrange [0:92]
set ytics 15
set key maxrows 2
set arrow from 1, 60 to 30, 60 nohead ls 6 front
set label 'η = 60°: the cyclic hands over to the elevator' at 11.5, 56.5 left tc rgb muted front
set label 'no trim' at 2.2, 14 left tc rgb muted front
set label 'no trim' at 14.2, 62 left tc rgb muted font ',12' front
set label 'trim within the limits' at 19, 30 left tc rgb '#1b1f24' front
# The whole range of the search is filled; each border then clears its side without a trim.
set style fill solid noborder
set object 1 rectangle from 1, 0 to 30, 90 fc rgb stable fillstyle solid noborder behind
piece(name, x) = strcol(3) eq name ? x : NaN
plot rows using (piece('delta_e lower', $4)):5 with filledcurves y1=0 lc rgb 'white' notitle, \
     rows using (piece('delta_e upper', $4)):5 with filledcurves x1=1 lc rgb 'white' notitle, \
     rows using (piece('a1s lower', $4)):5 with filledcurves y1=60 lc rgb 'white' notitle, \
     rows using (piece('theta0 upper', $4)):5 with filledcurves y1=90 lc rgb 'white' notitle, \
     rows using (piece('delta_e lower', $4)):5 with lines ls 1 title 'elevator at its lower limit', \
     rows using (piece('delta_e upper', $4)):5 with lines ls 2 title 'elevator at its upper limit', \
     rows using (piece('a1s lower', $4)):5 with lines ls 4 title 'cyclic at its lower limit', \
     rows using (piece('theta0 upper', $4)):5 with lines ls 3 title 'full thrust', \
     rows using (piece('fold', $4)):5 with lines ls 5 title 'folds: three trims between them'
