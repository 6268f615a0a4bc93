// Distances behind the first strand, mm, up to which a lamp's map sums opacity; the last one takes all that is farther too.
const vec4 DEEP_MM = vec4(0.7, 2.2, 6.0, 18.0);
