// SPDX-License-Identifier: MIT
import io.aeron.Aeron;
import io.aeron.ExclusivePublication;
import io.aeron.FragmentAssembler;
import io.aeron.Subscription;
import io.aeron.driver.MediaDriver;
import io.aeron.driver.ThreadingMode;
import io.aeron.logbuffer.BufferClaim;
import io.aeron.logbuffer.FragmentHandler;
import java.io.IOException;
import java.util.HashMap;
import java.util.Map;
import org.agrona.BitUtil;
import org.agrona.BufferUtil;
import org.agrona.DirectBuffer;
import org.agrona.MutableDirectBuffer;
import org.agrona.concurrent.BackoffIdleStrategy;
import org.agrona.concurrent.BusySpinIdleStrategy;
import org.agrona.concurrent.IdleStrategy;
import org.agrona.concurrent.UnsafeBuffer;

/**
 * Aeron as a peer of `mpf bench local`: IPC with exclusive publications, one stream in each
 * direction. The protocol is in benchmarks/README.md, "Add a peer in another language".
 *
 * <p>The media driver runs in the process of the server with one thread (ThreadingMode.SHARED), and
 * sleeps when it has no work: both CPUs belong to the polling threads of server and requester. No
 * message passes it.
 *
 * <p>A message of one fragment is written in place (tryClaim). A longer one is copied by offer() and
 * put together by the receiver: Aeron has no other way.
 */
public final class AeronPeer implements Timing.Peer {
    private static final int REQUESTS = 1;
    private static final int REPLIES = 2;
    private static final int FRAGMENTS = 64; // of one poll, at most

    private final int bytes;
    private final boolean touches;
    private final IdleStrategy idle;
    private final BufferClaim claim = new BufferClaim();
    private final UnsafeBuffer copy;
    private final FragmentHandler handler;
    private ExclusivePublication out;
    private Subscription back;
    private long received;
    private long awaited;
    private byte value;
    private volatile long sum; // written once for each message, so that it is computed

    private AeronPeer(final Map<String, String> options, final boolean answers) {
        bytes = Integer.parseInt(options.get("bytes"));
        touches = options.get("touch").equals("1");
        idle = options.get("mode").equals("spin")
            ? BusySpinIdleStrategy.INSTANCE
            : new BackoffIdleStrategy();
        copy = new UnsafeBuffer(BufferUtil.allocateDirectAligned(bytes, BitUtil.CACHE_LINE_LENGTH));
        final FragmentHandler take = (buffer, offset, length, header) -> {
            if (touches) readAll(buffer, offset, length);
            received++;
            if (answers) send();
        };
        handler = isShort() ? take : new FragmentAssembler(take);
    }

    private boolean isShort() {
        return bytes <= 4096;
    }

    // Terms of 64 MiB are Aeron's default for IPC. With shorter ones a sender of many messages
    // waits for the driver, which moves the limit of the sender once in a cycle of up to 1 ms.
    // Fragments of 8 KiB are those of the authors' script for IPC; longer messages get the longest.
    private String channel() {
        return "aeron:ipc?term-length=64m|mtu=" + (isShort() ? 8192 : 65504);
    }

    private void open(final Aeron aeron, final int outStream, final int backStream) {
        if (backStream != 0) back = aeron.addSubscription(channel(), backStream);
        if (outStream != 0) out = aeron.addExclusivePublication(channel(), outStream);
    }

    private void waitUntilConnected() {
        while ((out != null && !out.isConnected()) || (back != null && !back.isConnected()))
            Thread.yield();
    }

    @Override
    public void send() {
        if (isShort()) {
            while (out.tryClaim(bytes, claim) < 0) idle.idle();
            if (touches) writeAll(claim.buffer(), claim.offset());
            claim.commit();
        } else {
            if (touches) writeAll(copy, 0);
            while (out.offer(copy, 0, bytes) < 0) idle.idle();
        }
    }

    @Override
    public void receive() {
        awaited++;
        while (received < awaited) idle.idle(back.poll(handler, FRAGMENTS));
    }

    private void writeAll(final MutableDirectBuffer buffer, final int offset) {
        buffer.setMemory(offset, bytes, ++value);
    }

    private void readAll(final DirectBuffer buffer, final int offset, final int length) {
        long a = 0;
        long b = 0;
        int at = offset;
        for (final int end = offset + length - 15; at < end; at += 16) {
            a += buffer.getLong(at);
            b += buffer.getLong(at + 8);
        }
        for (; at < offset + length; at++) a += buffer.getByte(at);
        sum = a + b;
    }

    private void answer(final Aeron aeron) {
        open(aeron, REPLIES, REQUESTS);
        System.out.println("ready");
        while (true) idle.idle(back.poll(handler, FRAGMENTS));
    }

    private void flood(final Aeron aeron) {
        open(aeron, REPLIES, 0);
        System.out.println("ready");
        waitUntilConnected();
        while (true) send();
    }

    private static Aeron connect(final String folder) {
        return Aeron.connect(new Aeron.Context().aeronDirectoryName(folder));
    }

    private static void serve(final Map<String, String> options, final String folder) {
        final MediaDriver driver = MediaDriver.launch(new MediaDriver.Context()
            .aeronDirectoryName(folder)
            .threadingMode(ThreadingMode.SHARED)
            .dirDeleteOnStart(true));
        final Aeron aeron = connect(driver.aeronDirectoryName());
        final boolean isOneWay = options.get("work").equals("one-way");
        final AeronPeer peer = new AeronPeer(options, !isOneWay);
        if (isOneWay) peer.flood(aeron);
        else peer.answer(aeron);
    }

    private static void measure(final Map<String, String> options, final String folder) {
        final Aeron aeron = connect(folder);
        final AeronPeer peer = new AeronPeer(options, false);
        final Timing timing = new Timing(Long.parseLong(options.get("warmUpNs")),
            Long.parseLong(options.get("measureNs")), System.out);
        final boolean isOneWay = options.get("work").equals("one-way");
        peer.open(aeron, isOneWay ? 0 : REQUESTS, REPLIES);
        peer.waitUntilConnected();
        switch (options.get("work")) {
            case "one-way" -> timing.rate(peer::receive);
            case "outstanding" -> timing.outstanding(peer, Integer.parseInt(options.get("window")));
            default -> timing.roundTrips(() -> {
                peer.send();
                peer.receive();
            });
        }
        System.out.flush();
        Runtime.getRuntime().halt(0);
    }

    // The runner closes the standard input at the end of the row, and removes the files.
    private static void endWithStandardInput() {
        final Thread thread = new Thread(() -> {
            try {
                while (System.in.read() >= 0) {
                }
            } catch (final IOException ended) {
                // as the end of the input
            }
            Runtime.getRuntime().halt(0);
        });
        thread.setDaemon(true);
        thread.start();
    }

    public static void main(final String[] words) {
        final Map<String, String> options = new HashMap<>();
        for (final String word : words) {
            final int equals = word.indexOf('=');
            options.put(word.substring(0, equals), word.substring(equals + 1));
        }
        endWithStandardInput();
        final String folder = "/dev/shm/" + options.get("name") + ".aeron";
        try {
            if (options.get("role").equals("server")) serve(options, folder);
            else measure(options, folder);
        } catch (final Exception failure) {
            System.out.println(failure);
            Runtime.getRuntime().halt(1);
        }
    }
}
