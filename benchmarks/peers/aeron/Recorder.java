// SPDX-License-Identifier: MIT
import java.io.PrintStream;

/** Counts durations in log-linear buckets: exact below 256 ns, then 128 for each power of two. */
final class Recorder {
    private final long[] buckets = new long[256 + 32 * 128];
    private long count;
    private long maxNs;

    void add(final long ns) {
        int index = (int) ns;
        if (ns >= 256) {
            final int shift = 64 - Long.numberOfLeadingZeros(ns) - 8;
            index = (int) Math.min(shift * 128 + (ns >> shift), buckets.length - 1);
        }
        buckets[index]++;
        count++;
        maxNs = Math.max(maxNs, ns);
    }

    long medianNs() {
        long seen = 0;
        for (int index = 0; index < buckets.length; index++) {
            seen += buckets[index];
            if (seen > count / 2) return upperNs(index);
        }
        return maxNs;
    }

    void report(final PrintStream out) {
        for (int index = 0; index < buckets.length; index++) {
            if (buckets[index] > 0)
                out.println("latency " + Math.min(upperNs(index), maxNs) + " " + buckets[index]);
        }
    }

    private static long upperNs(final int index) {
        if (index < 256) return index;
        final int shift = index / 128 - 1;
        return ((index % 128 + 129L) << shift) - 1;
    }
}
