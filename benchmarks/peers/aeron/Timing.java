// SPDX-License-Identifier: MIT
import java.io.PrintStream;
import java.util.Arrays;

/** The loops of the requester, which are those of benchmarks/stage/timing.h, and its report. */
final class Timing {
    private final long warmUpNs;
    private final long measureNs;
    private final PrintStream out;

    Timing(final long warmUpNs, final long measureNs, final PrintStream out) {
        this.warmUpNs = warmUpNs;
        this.measureNs = measureNs;
        this.out = out;
    }

    /** Half of the time each round trip is timed, the other half in groups. */
    void roundTrips(final Runnable roundTrip) {
        // Both loops are translated before one of them counts.
        each(roundTrip, warmUpNs / 2, 0, new Recorder());
        groups(roundTrip, warmUpNs / 2, 1000);
        final long costNs = costOfReading();
        final Recorder recorder = new Recorder();
        each(roundTrip, measureNs / 2, costNs, recorder);
        out.println("typical " + groups(roundTrip, measureNs / 2, recorder.medianNs()));
        recorder.report(out);
    }

    private static void each(
        final Runnable roundTrip, final long durationNs, final long costNs, final Recorder recorder) {
        final long end = System.nanoTime() + durationNs;
        for (long now = 0; now < end;) {
            final long from = System.nanoTime();
            roundTrip.run();
            now = System.nanoTime();
            recorder.add(Math.max(0, now - from - costNs));
        }
    }

    private static double groups(final Runnable roundTrip, final long durationNs, final long aboutNs) {
        final int perGroup = (int) Math.max(1, Math.min(100, 20_000 / Math.max(1, aboutNs)));
        final double[] groups = new double[1 << 16];
        int count = 0;
        final long end = System.nanoTime() + durationNs;
        for (long now = 0; (now < end && count < groups.length) || count == 0;) {
            final long from = System.nanoTime();
            for (int i = 0; i < perGroup; i++) roundTrip.run();
            now = System.nanoTime();
            groups[count++] = (double) (now - from) / perGroup;
        }
        Arrays.sort(groups, 0, count);
        return groups[count / 2];
    }

    /** The time between two readings of the clock with nothing between them. */
    private static long costOfReading() {
        final long[] costs = new long[10_000];
        for (int i = 0; i < costs.length; i++) {
            final long from = System.nanoTime();
            costs[i] = System.nanoTime() - from;
        }
        Arrays.sort(costs);
        return costs[costs.length / 2];
    }

    /** Keeps `window` requests outstanding. */
    void outstanding(final Peer peer, final int window) {
        for (int i = 0; i < window; i++) peer.send();
        rate(() -> {
            peer.receive();
            peer.send();
        });
    }

    /** Calls `step`, which completes one message, repeatedly. */
    void rate(final Runnable step) {
        final long warm = System.nanoTime() + warmUpNs;
        while (System.nanoTime() < warm) runSome(step);
        final long from = System.nanoTime();
        long steps = 0;
        long now = from;
        for (; now - from < measureNs; now = System.nanoTime()) {
            runSome(step);
            steps += 64;
        }
        out.println("rate " + steps + " " + (now - from));
    }

    private static void runSome(final Runnable step) {
        for (int i = 0; i < 64; i++) step.run();
    }

    /** What a peer does in a measurement. */
    interface Peer {
        void send();

        void receive();
    }
}
