#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""interop_test LAYOUT TRAFFIC VICTIM MPF: programs of an older layout and today's talk to each
other, and take each other's place."""

import json
import os
import signal
import unittest

import client
import doorbell
import link
import messages
from interop import MPF, SLEEPS, VICTIM, WATCHDOG_SECONDS, Interop
from party import run_until


class OldClientOfTodaysServer(Interop):
    def setUp(self):
        super().setUp()
        self.server = self.todays_server()
        self.client = self.old_client()

    def test_has_its_requests_answered(self):
        connection = self.connected(self.client)
        for i in range(3):
            self.assertEqual(
                self.ask(self.client, connection, messages.INT32, messages.int32(1000 + i)),
                1000 + i,
            )
            self.assertEqual(
                self.ask(self.client, connection, messages.FLOAT64, messages.float64(i)), i + 1
            )

        self.assertEqual({reply.flags for reply in connection.received}, {2})

    def test_gets_more_replies_than_fit_into_the_first_ring(self):
        connection = self.connected(self.client)
        header = connection.link.header
        numbers = []
        for i in range(header["queueSize"]):
            connection.send(messages.FLOAT64, messages.float64(i))
            numbers.append(i + 1)
        self.assertEqual(connection.link.control["hasMoreReplies"], 1)
        while connection.link.control["serverSent"] != len(numbers):  # nothing is taken
            os.sched_yield()
        self.assertNotEqual(connection.link.control["repliesMoved"], 0)

        run_until(lambda: len(connection.received) == len(numbers), self.client)

        self.assertEqual([messages.value(one) for one in connection.received], numbers)
        self.assertEqual(
            self.ask(self.client, connection, messages.FLOAT64, messages.float64(7)), 8
        )

    def test_is_woken_however_it_sleeps(self):
        connection = self.connected(self.client)
        for how, sleep in SLEEPS.items():
            self.client.window.hinted.clear()
            self.stop_until_asleep(self.server, self.client, how)
            self.assertEqual(
                self.ask(
                    self.client, connection, messages.FLOAT64, messages.float64(how), sleep=sleep
                ),
                how + 1,
            )
            self.assertEqual(self.client.window.hinted, {0})

    def replies_polled_for(self, connection, count):
        for _ in range(count):
            connection.send(messages.FLOAT64, messages.float64(0))
            while not connection.link.into.has_message():
                os.sched_yield()
            self.client.work()

    def test_gets_no_notice_while_it_polls_and_is_woken_when_it_has_stopped(self):
        connection = self.connected(self.client)
        for watch in self.ways_to_poll(connection):
            connection.link.watch(watch)
            self.replies_polled_for(connection, 2)  # with the second one, all earlier notices came
            self.client.window.hinted.clear()
            self.replies_polled_for(connection, 100)
            self.assertEqual(self.client.window.hinted, set())

            connection.link.watch(link.UNWATCHED)
            for how, sleep in SLEEPS.items():
                self.client.window.hinted.clear()
                self.stop_until_asleep(self.server, self.client, how)
                self.ask(
                    self.client, connection, messages.FLOAT64, messages.float64(0), sleep=sleep
                )
                self.assertEqual(self.client.window.hinted, {0})

    def test_loses_no_reply_when_it_stops_polling(self):
        connection = self.connected(self.client)
        for watch in self.ways_to_poll(connection):
            for i in range(500):
                connection.link.watch(watch)
                had = len(connection.received)
                connection.send(messages.FLOAT64, messages.float64(i))
                connection.link.watch(link.UNWATCHED)
                run_until(lambda had=had: len(connection.received) > had, self.client)

    def ways_to_poll(self, connection):
        takes_barriers = connection.link.peer.header["takesBarriers"]
        return (link.POLLED, link.POLLED_UNFENCED) if takes_barriers else (link.POLLED,)

    def test_wakes_it(self):
        connection = self.connected(self.client)
        for i in range(3):
            while connection.link.peer.control["sleeping"] == doorbell.AWAKE:
                os.sched_yield()
            self.assertEqual(
                self.ask(self.client, connection, messages.FLOAT64, messages.float64(i)), i + 1
            )

    def test_gets_arrays_back_in_slots_in_its_own_chunks_and_in_the_servers(self):
        connection = self.connected(self.client)
        ways = set()
        for i in range(1, 31):
            sent = tuple(range(i, i + (10 if i % 4 == 0 else 100 * i)))
            expected = 3000 if i % 3 == 0 else len(sent)
            seen = self.ask(
                self.client, connection, messages.FLOAT64_ARRAY, messages.float64_array(sent)
            )
            self.assertEqual(len(seen), expected)
            self.assertTrue(i % 3 == 0 or seen == sent)
            chunk = connection.received[-1].chunk
            ways.add(chunk and chunk[0])

        self.assertEqual(ways, {None, 0, 1, 2})
        published = [name for name in self.names() if ".p." in name]
        self.assertEqual(len(published), 1, "each was returned before the next one")
        self.assertEqual(
            self.ask(self.client, connection, messages.FLOAT64, messages.float64(1)), 2
        )
        connection.link.pool.collect()
        self.assertEqual(connection.link.pool.lent, set(), "every chunk has come home")

    def test_is_told_of_requests_that_nobody_answers(self):
        connection = self.connected(self.client)
        for i in range(14):
            connection.send(messages.INT32, messages.int32(i), clientType=i)
        run_until(lambda: len(connection.received) == 13, self.client)

        connection.send(messages.INT32, messages.int32(0), deadlineNs=1)
        run_until(lambda: len(connection.received) == 14, self.client)

        fates = [
            messages.value(message)
            for message in connection.received
            if message.type == messages.REQUEST_FATE
        ]
        self.assertEqual(
            fates,
            [(messages.REFUSED, 7), (messages.EXPIRED, 15)],
            "the server kept the seventh until it got another to keep",
        )

    def test_shares_it_with_todays_clients(self):
        crowd = self.crowd(3)
        connection = self.connected(self.client)
        for i in range(20):
            self.assertEqual(
                self.ask(self.client, connection, messages.FLOAT64, messages.float64(i)), i + 1
            )

        self.assert_answers(crowd, self.incarnation(), self.client)

    def test_leaves_and_leaves_nothing(self):
        connection = self.connected(self.client)
        self.ask(
            self.client, connection, messages.FLOAT64_ARRAY, messages.float64_array([0] * 1000)
        )
        self.client.drop(connection)
        self.assertEqual([name for name in self.names() if ".l." in name or ".b." in name], [])
        self.client.close()

        self.assertEqual(len(self.names()), 3, "window, hints and pipe of the server")
        another = self.old_client()
        self.assertEqual(
            self.ask(another, self.connected(another), messages.INT32, messages.int32(5)), 5
        )

    def test_that_is_killed_is_noticed_and_cleaned_up(self):
        child = os.fork()
        if child == 0:
            self.be_killed_as_a_client()
        os.waitpid(child, 0)
        connection = self.connected(self.client)
        # 7 files: of the server, of the client that lives, and their link. The server removes the
        # files of the dead client before it counts it.
        while len(self.names()) != 7 or connection.link.peer.control["peersDied"] == 0:
            self.ask(self.client, connection, messages.FLOAT64, messages.float64(0))

        self.assertEqual(connection.link.peer.control["peersDied"], 1)

    def be_killed_as_a_client(self):
        signal.alarm(WATCHDOG_SECONDS)
        try:
            victim = client.Client(self.layout, self.backplane, "killed")
            self.ask(
                victim,
                self.connected(victim),
                messages.FLOAT64_ARRAY,
                messages.float64_array([0] * 1000),
            )
        finally:
            os.kill(os.getpid(), signal.SIGKILL)


class TodaysClientOfAnOldServer(Interop):
    def setUp(self):
        super().setUp()
        self.server = self.old_server()

    def test_has_its_requests_answered(self):
        answer = json.loads(
            self.call(
                "float64", "value=3", "--count", "20", "--json", "--print", parties=[self.server]
            )
        )

        self.assertEqual((answer["replied"], answer["failed"]), (20, 0))
        self.assertEqual({reply["value"] for reply in answer["replies"]}, {4})
        run_until(lambda: self.server.ends == {}, self.server)  # the client has left

    def test_gets_arrays_back_in_slots_in_its_own_chunks_and_in_the_servers(self):
        for length, count in ((10, 1), (1000, 12)):
            sent = list(range(length))
            words = (
                "float64Array",
                "value=" + ",".join(map(str, sent)),
                "--count",
                str(count),
                "--json",
                "--print",
            )
            answer = json.loads(self.call(*words, parties=[self.server]))
            self.assertEqual([reply["value"] for reply in answer["replies"]], [sent] * count)
        self.assertEqual(self.server.published, 3)
        self.assertEqual(len(self.published_files()), 1, "it returned each before the next one")
        run_until(lambda: self.server.ends == {}, self.server)  # the client has left
        self.assertEqual(self.server.fan_out.retired, set(), "it had returned all of them")

    def published_files(self):
        return [name for name in self.names() if f".p.{self.server.window.incarnation:x}." in name]

    def test_has_more_replies_than_fit_into_the_first_ring(self):
        """For an old client, which understands them from today's server, too."""
        self.server.close()
        self.server = self.old_server(queueSize=100)
        party = self.old_client()
        connection = self.connected(party, self.server)
        numbers = []
        for i in range(60):  # of two slots each
            connection.send(messages.FLOAT64, messages.float64(i))
            numbers.append(i + 1)
        self.server.work()  # answers all; nothing is taken
        self.assertNotEqual(connection.link.control["repliesMoved"], 0)

        run_until(lambda: len(connection.received) == len(numbers), party)

        self.assertEqual([messages.value(one) for one in connection.received], numbers)

    def test_shares_it_with_an_old_client(self):
        party = self.old_client()
        crowd = self.crowd(3, party, self.server)
        connection = self.connected(party, self.server)
        for i in range(20):
            self.assertEqual(
                self.ask(party, connection, messages.FLOAT64, messages.float64(i), self.server),
                i + 1,
            )

        self.assert_answers(crowd, self.server.window.incarnation, party, self.server)

    def test_wakes_it_however_it_sleeps(self):
        for how, sleep in SLEEPS.items():
            answered = self.server.answered
            crowd = self.crowd(1)
            self.stop_until_asleep(crowd, self.server, how)
            run_until(lambda: self.server.answered == answered + 50, self.server, sleep=sleep)

    def test_that_is_killed_is_noticed_and_cleaned_up(self):
        crowd = self.crowd(1, self.server)
        self.assert_answers(crowd, self.server.window.incarnation, self.server)
        crowd.process.kill()
        crowd.process.wait()
        doorbell.nudge_seconds = 1  # its way to look for the dead
        run_until(lambda: not self.server.ends, self.server)

        self.assertEqual([name for name in self.names() if ".l." in name or ".b." in name], [])

    def test_is_seen_by_todays_tools(self):
        shown = self.program(MPF, "ls", "--backplane", self.backplane).rest(self.server)

        self.assertRegex(shown, r"echo +alive +\d+ +layout-1\.\d+")
        self.assertNotIn("problem", shown)


class Rollout(Interop):
    """Process by process, in either direction."""

    def test_an_old_client_waits_for_todays_server(self):
        party = self.old_client()
        pending = party.pending_bind("echo")
        self.addCleanup(pending.close)
        self.assertRegex(
            self.program(MPF, "ls", "--backplane", self.backplane).rest(),
            r"old \(layout-1\.\d+\) +alive .* echo \(waiting\)",
        )
        self.assertFalse(pending.is_granted())
        self.program(VICTIM, "serve-block", self.backplane)
        run_until(pending.is_granted, party, files=[pending.names])

        self.assertEqual(
            self.ask(party, self.connected(party), messages.INT32, messages.int32(1)), 1
        )

    def test_todays_clients_stay_while_an_old_server_is_replaced_by_todays_and_back(self):
        server_party = self.old_server()
        crowd = self.crowd(3, server_party)
        self.assert_answers(crowd, server_party.window.incarnation, server_party)
        server_party.close()

        todays = self.todays_server()
        self.assert_answers(crowd, self.incarnation())
        todays.end()

        server_party = self.old_server()
        self.assert_answers(crowd, server_party.window.incarnation, server_party)

    def test_todays_clients_get_the_fates_of_what_an_old_server_leaves_undone(self):
        server_party = self.old_server()
        server_party.limit = 20
        crowd = self.crowd(3, server_party)
        run_until(lambda: server_party.answered == 20, server_party)
        server_party.close()

        self.todays_server()
        self.assert_answers(crowd, self.incarnation())

    def test_an_old_client_stays_while_todays_server_is_replaced_by_an_old_one_and_back(self):
        party = self.old_client()
        todays = self.todays_server()
        connection = self.connected(party)
        self.assertEqual(self.ask(party, connection, messages.INT32, messages.int32(1)), 1)
        todays.end()
        run_until(lambda: connection.is_closed, party)

        server_party = self.old_server()
        connection = self.connected(party, server_party)
        self.assertEqual(
            self.ask(party, connection, messages.INT32, messages.int32(2), server_party), 2
        )
        server_party.close()
        run_until(lambda: connection.is_closed, party)

        self.todays_server()
        self.assertEqual(
            self.ask(party, self.connected(party), messages.INT32, messages.int32(3)), 3
        )


if __name__ == "__main__":
    unittest.main()
