# The flight of studies/transition_as_drawn.toml with the features of the paper's Figures 5, 6, 8 and 9: make figures
load 'docs/figures/style.gp'
set output 'docs/figures/as_drawn.svg'
set terminal svg size 860,640 dynamic font 'sans-serif,14' background rgb 'white'
flight = 'build/as_drawn.csv'
set xrange [0:90]
set xlabel 'time [s]'
set multiplot layout 2,2
paper = stable

set ylabel 'fig. 5: pitch θ, path γ [rad]'
set yrange [-0.1:1.8]
set object 1 rect from 5,0.8 to 25,1.5 fc rgb paper fs solid noborder behind
set object 2 rect from 5,0.1 to 25,0.3 fc rgb paper fs solid noborder behind
set object 3 rect from 75,0.1 to 90,0.2 fc rgb paper fs solid noborder behind
plot flight using 'time':(column('gamma_deg') * pi / 180) every 5 with lines ls 1 title 'γ', \
     flight using 'time':(column('theta_deg') * pi / 180) every 5 with lines ls 2 title 'θ'

set ylabel 'fig. 6: speed up, forward [m/s]'
set yrange [-1:16]
set object 1 rect from 5,1.9 to 25,2.1
set object 2 rect from 0,-0.5 to 25,0.5
set object 3 rect from 75,14.8 to 90,15.2
plot flight using 'time':'climb_rate' every 5 with lines ls 1 title 'up', \
     flight using 'time':'ground_speed' every 5 with lines ls 2 title 'forward'

set ylabel 'fig. 8: distance [m]'
set yrange [-50:1050]
set object 1 rect from 0,-20 to 25,20
set object 2 rect from 87,850 to 90,1000
unset object 3
plot flight using 'time':'distance' every 5 with lines ls 1 notitle

set ylabel 'fig. 9: height [m]'
set yrange [0:200]
set object 1 rect from 22,45 to 28,65
set object 2 rect from 75,120 to 90,180
plot flight using 'time':'height' every 5 with lines ls 1 notitle
unset multiplot
