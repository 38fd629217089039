# The style of tiltrim report, for the pictures of the documents.
set terminal svg size 860,440 dynamic font 'sans-serif,14' background rgb 'white'
set datafile separator ','
set border 3 lc rgb '#1b1f24'
set tics nomirror textcolor rgb '#1b1f24'
set grid lc rgb '#d9dde2' lt 1 lw 0.7
set clip two
set key tmargin left Left reverse horizontal samplen 3 width 1
set style line 1 lc rgb '#1c1cc4' lw 2.2 dt 1
set style line 2 lc rgb '#b88a00' lw 2.2 dt 2
set style line 3 lc rgb '#8f2400' lw 2.2 dt 1
set style line 4 lc rgb '#008ab8' lw 2.2 dt 4
set style line 5 lc rgb '#4c535c' lw 1.2 dt 1
set style line 6 lc rgb '#4c535c' lw 1.2 dt 2
stable = '#d3e6f8'
unstable = '#fbe0c8'
muted = '#4c535c'
