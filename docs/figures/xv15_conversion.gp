# docs/figures/xv15_conversion.svg from build/xv15_conversion.csv (build/bin/xv15_conversion 1 STUDY FILE).
set datafile separator ","
set terminal svg size 760,660 dynamic font "sans-serif,13"
set output "docs/figures/xv15_conversion.svg"
set multiplot layout 3,1 margins 0.11,0.89,0.09,0.98 spacing 0.03
set xrange [0:190]
set format x ""
set ylabel "kt"
set y2label "nacelle, degrees"
set ytics nomirror
set y2tics 0,30,90
set y2range [-5:95]
set yrange [0:175]
set key at graph 0.66,0.55 right
plot file every ::1 using 1:2 with lines lw 2 dt 2 lc rgb "#888888" title "commanded airspeed", \
     file every ::1 using 1:3 with lines lw 2 lc rgb "#1f5fa8" title "airspeed", \
     file every ::1 using 1:(90-$4) axes x1y2 with lines lw 2 lc rgb "#c4620a" title "nacelle angle"
unset y2label
unset y2tics
set ytics mirror
set ylabel "degrees"
set yrange [-20:35]
set key at graph 0.99,0.95 right
plot file every ::1 using 1:5 with lines lw 2 lc rgb "#1f5fa8" title "pitch", \
     file every ::1 using 1:7 with lines lw 2 lc rgb "#c4620a" title "collective"
set format x "%g"
set xlabel "t, s"
set ylabel "m/s, in"
set yrange [-4:8]
set key at graph 0.99,0.70 right
plot file every ::1 using 1:8 with lines lw 2 lc rgb "#1f5fa8" title "climb, m/s", \
     file every ::1 using 1:6 with lines lw 2 lc rgb "#c4620a" title "stick, in"
