# shellcheck shell=bash
# Read by tools/bench and tools/tables: where their files go, and figures out of what wisp writes.
out=build/bench
wisp=build/wisp
QUICK=${QUICK:-}
mkdir -p $out

seconds() { sed -n "s/.*\"seconds\": {[^}]*\"$2\": \([0-9.]*\).*/\1/p" "$1"; } # FILE STAGE, from --stats
number() { sed -n "s/.*\"$2\": \([0-9]*\)[ ,}].*/\1/p" "$1"; }                 # FILE COUNTER, or bytes
compare() { { $wisp compare "$1" "$2" "${@:4}" || true; } | sed -n "s/^ *$3  *//p"; } # A B FIGURE [OPTIONS]
error() { compare "$1" "$2" 'relative RMSE'; }
calculate() { # FORMAT EXPRESSION; - where a figure is missing
    local result
    result=$(awk "BEGIN { printf \"$1\", ($2) }" 2> /dev/null) || true
    case $result in "" | *inf* | *nan*) echo - ;; *) echo "$result" ;; esac
}
particles() { # RATE FRAME: the name of their file, made where it is missing
    local file=$out/plume_$1.vtk
    [ "$2" = 275 ] || file=$out/plume_$1_$2.vtk
    [ -f "$file" ] || build/plume --rate "$1" --frame "$2" -o "$file"
    basename "$file"
}
