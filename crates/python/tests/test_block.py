"""Blocks as golden models, against integers computed here."""

import unittest

import numpy as np

import hpu


class Blocks(unittest.TestCase):
    def test_a_saturating_multiplier_multiplies_and_saturates(self):
        block = hpu.Block("truncating_multiplier")
        random = np.random.default_rng(1)
        a, b = random.integers(0, 4096, (2, 2000))
        product = block.tick(a, b)["product"]
        self.assertEqual((product.dtype, product.shape), (np.int64, (2000,)))
        np.testing.assert_array_equal(product, np.minimum(a * b, 4095))
        self.assertEqual(block.tick(60, 70), {"product": 4095})
        self.assertEqual(block.tick(b=np.uint8(70), a=np.int64(50)), {"product": 3500})
        np.testing.assert_array_equal(block.tick(a, b=3)["product"], np.minimum(3 * a, 4095))
        np.testing.assert_array_equal(block.tick([1, 2], [True, False])["product"], [1, 0])

    def test_a_counter_counts_edge_by_edge_as_in_arrays(self):
        names = [signal.name for signal in hpu.Block("position_counter").inputs]
        random = np.random.default_rng(2)
        rows = {
            signal.name: random.integers(signal.min, signal.max, 500, endpoint=True)
            for signal in hpu.Block("position_counter").inputs
        }
        whole, single = hpu.Block("position_counter"), hpu.Block("position_counter")
        columns = whole.tick(**rows)
        for edge in range(500):
            words = single.tick(**{name: rows[name][edge] for name in names})
            self.assertEqual(words, {name: column[edge] for name, column in columns.items()})
        self.assertEqual(whole.reset(), single.reset())

    def test_long_arrays_of_any_type_and_stride_are_ticked_without_a_gap(self):
        pwm = hpu.Block("pwm", WIDTH=6)
        command = next(signal for signal in pwm.inputs if signal.max > 1)
        for duty, words in [
            (17, np.full(64_000, 17, np.int8)),
            (5, np.full(128_000, 5)[::2]),
            (63, np.full(64_000, 63, np.uint64)[::-1]),
            (1, np.broadcast_to(np.uint16(1), 64_000)),
        ]:
            pwm.reset()
            columns = pwm.tick(**{command.name: words})
            high = int(columns["a_high"].sum() + columns["b_high"].sum())
            self.assertEqual(high, 1000 * duty, "over a thousand periods of 64 edges")
        product = hpu.Block("truncating_multiplier")
        a = np.arange(100_000) % 64
        np.testing.assert_array_equal(product.tick(a, a[::-1])["product"], a * a[::-1])
        # More than any memory, of which the array itself takes none.
        with self.assertRaises(MemoryError):
            product.tick(np.broadcast_to(1, 10**17), 1)
        self.assertEqual(product.tick(2, 3), {"product": 6})

    def test_a_pwm_is_high_for_its_duty(self):
        pwm = hpu.Block("pwm", WIDTH=6)
        command = next(signal for signal in pwm.inputs if signal.max > 1)
        gates = [signal.name for signal in pwm.outputs]
        self.assertIn("a_high", gates)
        for duty in (0, 1, 17, 63):
            pwm.reset()
            columns = pwm.tick(**{command.name: np.full(256, duty)})
            high = int(columns["a_high"].sum() + columns["b_high"].sum())
            self.assertEqual(high, 4 * duty, "over four periods of 64 edges")

    def test_signals_are_described(self):
        a, b = hpu.Block("truncating_multiplier").inputs
        self.assertEqual((a.name, a.min, a.max, a.format), ("a", 0, 4095, (0, 12, 0)))
        self.assertTrue(a.doc and a.unit and repr(b))
        self.assertIn("pwm", hpu.blocks())

    def test_bad_input_is_refused_with_what_is_accepted(self):
        block = hpu.Block("truncating_multiplier")
        cases = [
            ((), {}, "input a is missing; accepted: a, b"),
            ((1,), {"a": 1}, "a is given twice"),
            ((1, 2, 3), {}, "3 inputs given"),
            ((1, 2), {"c": 1}, "no input c; accepted: a, b"),
            ((1.5, 2), {}, "accepted: a whole number"),
            (("x", 2), {}, "input a is x (<class 'str'>); accepted: a whole number"),
            (({1, 2}, 2), {}, "accepted: whole numbers in 1 dimension"),
            ((None, 2), {}, "accepted: a whole number"),
            ((10**30, 2), {}, "accepted: a whole number of 64 bits"),
            ((np.ones(3), 2), {}, "an array of float64 in 1 dimensions; accepted: whole numbers in 1 dimension"),
            ((np.ones((2, 2), int), 2), {}, "in 2 dimensions"),
            ((np.array([2**64 - 1], np.uint64), 2), {}, "beyond 64 bits"),
            (([1, 2], [1, 2, 3]), {}, "a has 2 words and b 3; accepted: arrays of one length"),
            ((4096, 2), {}, "input a is 4096; accepted: 0 to 4095"),
            (([1, 4096], 2), {}, "row 1: input a is 4096; accepted: 0 to 4095"),
        ]
        for words, names, text in cases:
            with self.subTest(words=words, names=names):
                with self.assertRaises(hpu.ArgumentError) as refusal:
                    block.tick(*words, **names)
                self.assertIn(text, str(refusal.exception))
        self.assertEqual(block.tick([], [])["product"].shape, (0,))
        for name, generics, text in [
            ("pwmm", {}, "did you mean pwm?"),
            ("pwm", {"WITH": 3}, "accepted: WIDTH"),
            ("pwm", {"WITDH": 3}, "did you mean WIDTH?"),
            ("pwm", {"WIDTH": 3.5}, "WIDTH is 3.5; accepted: a whole number"),
            ("pwm", {"WIDTH": 1000}, "pwm"),
        ]:
            with self.assertRaises(hpu.ArgumentError) as refusal:
                hpu.Block(name, **generics)
            self.assertIn(text, str(refusal.exception))


if __name__ == "__main__":
    unittest.main()
