"""Random streams are even, independent of each other, and share no stretch; and the checks would see it if not.

Two generators make all random numbers of trials. `layoutopt.streams` gives Philox4x64 generators (numpy) keyed by
seed, scenario, replication and purpose; the compiled filters take the words of Philox4x32 at counters of step,
purpose and index, under a key of two words from the stream of a trial's filter. Both go through the same checks
(`stream_checks`).

Every application of a check to a sound stream has a false-alarm rate of `FALSE_ALARM` over the choice of the
seed, and all of them together one of at most `ALL_FALSE_ALARMS`, a millionth. Seeds are fixed, so that a run today
is a run tomorrow. That the checks have power is a test too: each is held against streams broken on purpose.

Why distinct keys are distinct sequences that do not overlap: for every key Philox is a bijection of its counters,
of 256 bits in a stream and 128 in a filter, so no block of words comes twice under one key before the counters are
used up. Another key is another bijection, not the same cycle entered elsewhere: there is no shift at which two of
them agree, and two blocks are equal by chance alone, one pair of 2^256 or 2^128.
"""

import functools
import hashlib
import itertools

import numpy as np
import pytest
from stream_checks import (
    CHECKS,
    independent_pairs,
    no_overlap,
    normal,
    serial,
    uncorrelated,
    uniform,
    unlike_bits,
    words_of,
)

from layoutopt.estimators import counter_normals, counter_normals_kernels
from layoutopt.estimators.counter_normals import Draw, blocks, key_words
from layoutopt.streams import Purpose, Streams

ALL_FALSE_ALARMS = 1e-6
FALSE_ALARM = 5e-9
SEED = 2026
STREAMS = 32
COUNT = 4096
"""Streams side by side, and words of 64 bits of each."""
NORMALS = 4 * COUNT


def alarms(words):
    """Return the checks that alarm, and their chances."""
    chances = {check.__name__: check(words) for check in CHECKS}
    return {name: chance for name, chance in chances.items() if chance < FALSE_ALARM}


def name_of(part):
    """Return what a parameter of a test is called."""
    return getattr(part, "__name__", part)


def stream(seed, scenario, replication, purpose, count=COUNT):
    """Return the first words of a stream."""
    return Streams(seed=seed).generator(scenario, replication, purpose).bit_generator.random_raw(count)


def beginnings(family):
    """Return the k-th words of many replications side by side: thousands of streams, each barely begun."""
    return np.array([family(SEED, "design", number, Purpose.ODOMETRY, STREAMS) for number in range(COUNT)]).T


@functools.cache
def side_by_side(family, what):
    """Return streams that differ in one part of their key, or in all of them."""
    purposes = itertools.cycle(Purpose)
    keys = {
        "seed": [(number, "design", 0, Purpose.ROUTE) for number in range(STREAMS)],
        "scenario": [(SEED, f"held-out/{number}", 0, Purpose.ROUTE) for number in range(STREAMS)],
        "replication": [(SEED, "design", number, Purpose.ROUTE) for number in range(STREAMS)],
        "purpose": [(SEED, "design", 100 + number // len(Purpose), next(purposes)) for number in range(STREAMS)],
        "everything": [(number % 3, f"s{number % 5}", number, next(purposes)) for number in range(STREAMS)],
    }
    return beginnings(family) if what == "beginnings" else np.array([family(*key) for key in keys[what]])


VARIED = ("seed", "scenario", "replication", "purpose", "everything", "beginnings")


@pytest.mark.parametrize("what", VARIED)
def test_streams_are_even_independent_and_apart(what):
    """Streams of other seeds, scenarios, replications, purposes: six checks of a false-alarm rate of 5e-9 each."""
    assert alarms(side_by_side(stream, what)) == {}


def without_seed(seed, scenario, replication, purpose, count=COUNT):
    """The seed is left out of the key."""
    return stream(0, scenario, replication, purpose, count)


def without_scenario(seed, scenario, replication, purpose, count=COUNT):
    """The scenario is left out of the key."""
    return stream(seed, "", replication, purpose, count)


def without_replication(seed, scenario, replication, purpose, count=COUNT):
    """The replication is left out of the key."""
    return stream(seed, scenario, 0, purpose, count)


def without_purpose(seed, scenario, replication, purpose, count=COUNT):
    """The purpose is left out of the key."""
    return stream(seed, scenario, replication, Purpose.ROUTE, count)


def added(seed, scenario, replication, purpose, count=COUNT):
    """A key that is a sum: replication 1 for purpose 2 is replication 2 for purpose 1."""
    return stream(seed, scenario, replication + int(purpose), Purpose.ROUTE, count)


def shifted(seed, scenario, replication, purpose, count=COUNT):
    """One sequence for all replications, each entered 160 words after the one before."""
    generator = Streams(seed=seed).generator(scenario, 0, purpose).bit_generator
    generator.advance(40 * replication)
    return generator.random_raw(count)


def half_shared(seed, scenario, replication, purpose, count=COUNT):
    """The high 32 bits are sound, the low ones the same for all purposes."""
    own = stream(seed, scenario, replication, purpose, count)
    shared = stream(seed, scenario, 0, Purpose.ROUTE, count)
    return (own & np.uint64(0xFFFFFFFF_00000000)) | (shared & np.uint64(0xFFFFFFFF))


def opposite(seed, scenario, replication, purpose, count=COUNT):
    """Every second replication is the one before it with all bits turned."""
    words = stream(seed, scenario, replication - replication % 2, purpose, count)
    return ~words if replication % 2 else words


def folded(seed, scenario, replication, purpose, count=COUNT):
    """Every second replication is the one before it, folded at its middle: uncorrelated and wholly dependent."""
    words = stream(seed, scenario, replication - replication % 2, purpose, count)
    if replication % 2:
        words = np.where(words >> np.uint64(63), ~words, words) << np.uint64(1)
    return words


def congruential(seed, scenario, replication, purpose, count=COUNT):
    """A plain linear congruential generator (Knuth's MMIX), begun at the replication's number."""
    word, words = replication, []
    for _ in range(count):
        word = (6364136223846793005 * word + 1442695040888963407) % 2**64
        words.append(word)
    return np.array(words, dtype=np.uint64)


def uneven(seed, scenario, replication, purpose, count=COUNT):
    """The highest byte is never 255."""
    words = stream(seed, scenario, replication, purpose, count)
    return np.where(words >> np.uint64(56) == 255, words ^ np.uint64(1 << 63), words)


FORGOTTEN = (uncorrelated, independent_pairs, unlike_bits, no_overlap)
"""What sees two streams that are one and the same."""
POWER = [
    *((without_seed, "seed", check) for check in FORGOTTEN),
    *((without_scenario, "scenario", check) for check in FORGOTTEN),
    *((without_replication, "replication", check) for check in (*FORGOTTEN, serial)),
    *((without_purpose, "purpose", check) for check in (*FORGOTTEN, serial)),
    (added, "purpose", uncorrelated),
    (added, "purpose", no_overlap),
    (shifted, "replication", uncorrelated),
    (shifted, "replication", no_overlap),
    (half_shared, "purpose", unlike_bits),
    (opposite, "replication", uncorrelated),
    (opposite, "replication", unlike_bits),
    (folded, "replication", independent_pairs),
    (congruential, "beginnings", uncorrelated),
    (congruential, "beginnings", uniform),
    (uneven, "seed", uniform),
]


@pytest.mark.parametrize(("family", "what", "check"), POWER, ids=name_of)
def test_the_checks_see_broken_streams(family, what, check):
    """Streams with a part of the key left out, keys added up, shifted copies, shared bits: each is an alarm."""
    assert check(side_by_side(family, what)) < FALSE_ALARM


def test_every_check_is_shown_to_have_power():
    """No check stands in this file that has not caught something."""
    assert {check for _, _, check in POWER} == set(CHECKS)


def test_what_the_checks_see_is_not_seen_by_luck():
    """Streams that are broken in one respect pass checks that do not look there: alarms mean what they say."""
    assert uncorrelated(side_by_side(half_shared, "purpose")) > FALSE_ALARM
    assert uncorrelated(side_by_side(folded, "replication")) > FALSE_ALARM
    assert no_overlap(side_by_side(opposite, "replication")) > FALSE_ALARM


def hashed(value, constant, multiplier):
    following = constant * multiplier % 2**32
    value = (value ^ np.uint32(constant)) * np.uint32(following)
    return value ^ (value >> np.uint32(16)), following


def mixed(left, right):
    value = np.uint32(0xCA01F9DD) * left - np.uint32(0x4973F715) * right
    return value ^ (value >> np.uint32(16))


def keys_of(words):
    """Return the Philox keys, shape (2, n), of seed sequences of 8 or more words, shape (words, n): all at once.

    Numpy's SeedSequence written out: a pool of four words takes up one word after the other, and is stirred.
    """
    constant, pool = 0x43B0D7E5, []
    for word in words[:4]:
        stirred, constant = hashed(word, constant, 0x931E8875)
        pool.append(stirred)
    for source, target in itertools.permutations(range(4), 2):
        stirred, constant = hashed(pool[source], constant, 0x931E8875)
        pool[target] = mixed(pool[target], stirred)
    for word in words[4:]:
        for target in range(4):
            stirred, constant = hashed(word, constant, 0x931E8875)
            pool[target] = mixed(pool[target], stirred)
    constant, halves = 0x8B51F9DD, []
    for word in pool:
        half, constant = hashed(word, constant, 0x58F38DED)
        halves.append(half.astype(np.uint64))
    return np.stack([halves[0] | halves[1] << np.uint64(32), halves[2] | halves[3] << np.uint64(32)])


def key_columns(seeds, scenarios, replications, purposes):
    """Return the words of every combination, shape (8, n)."""
    names = [hashlib.sha256(name.encode()).digest() for name in scenarios]
    name_words = [[int.from_bytes(digest[at : at + 4], "big") for digest in names] for at in (0, 4)]
    grids = np.meshgrid(seeds, range(len(names)), replications, purposes, indexing="ij")
    seed, scenario, replication, purpose = (grid.ravel() for grid in grids)
    nothing = np.zeros(len(seed), np.uint32)
    columns = [seed, seed >> 32, nothing, nothing, *(np.array(words)[scenario] for words in name_words)]
    return np.array([*columns, replication, purpose], dtype=np.uint64).astype(np.uint32)


SEEDS = (0, 1, 7, 2**32, 2**63 - 1)
SCENARIOS = ("design/patrol", "held-out/point_to_point", "held-out/faults", "design", "desigm", "", "a", "b")


def distinct(keys):
    """Return how many keys are distinct."""
    return len(np.unique(np.ascontiguousarray(keys.T).view("V16")))


def test_the_keys_written_out_are_those_of_the_streams():
    """Of 240 streams: the key that the generator holds is that of `keys_of`, and its counter begins at zero."""
    some = (SEEDS, SCENARIOS[:4], (0, 1, 999, 2**32 - 1), (Purpose.ROUTE, Purpose.FILTER, Purpose.ASYNCHRONY))
    expected = keys_of(key_columns(*some)).T
    states = [Streams(seed=seed).generator(*rest).bit_generator.state for seed, *rest in itertools.product(*some)]
    np.testing.assert_array_equal([state["state"]["key"] for state in states], expected)
    assert not any(state["state"]["counter"].any() for state in states)


def test_a_million_streams_have_a_million_keys():
    """5 seeds, 8 scenarios, 2800 replications and all purposes, 1 008 000 streams: no key of 128 bits comes twice.

    Of two streams that differ in their seeds alone, in their replications alone or in their purposes alone it is
    certain: the pool takes up each word by bijections, as all multipliers are odd. Of streams that differ in more
    it is a matter of chance: among n keys two are equal with a chance below n² / 2^129 (birthday bound), for a
    million 1.5e-27, for 10^12 streams 1.5e-15. Two of m scenarios have the same 64 bits of SHA-256 with a chance
    below m² / 2^65.
    """
    columns = key_columns(SEEDS, SCENARIOS, np.arange(2800), list(Purpose))
    assert columns.shape[1] == 5 * 8 * 2800 * len(Purpose) > 1e6
    assert distinct(keys_of(columns)) == columns.shape[1]


def test_keys_that_leave_out_or_add_up_are_not_distinct():
    """The count of the test before sees a purpose that is left out and a replication that is added to it."""
    columns = key_columns(SEEDS[:1], SCENARIOS[:2], np.arange(100), list(Purpose))
    forgotten, summed = columns.copy(), columns.copy()
    forgotten[7] = 0
    summed[6], summed[7] = columns[6] + columns[7], 0
    assert distinct(keys_of(columns)) == columns.shape[1] == 200 * len(Purpose)
    assert distinct(keys_of(forgotten)) == 200
    assert distinct(keys_of(summed)) < columns.shape[1] / 4


def counter_words(key, step, draw, first=0, blocks_wanted=COUNT // 2):
    """Return the words of counters one after the other, two of 64 bits for each."""
    out = np.empty((4, blocks_wanted), np.uint32)
    counter_normals_kernels.philox_words(key[0], key[1], step, int(draw), first, out)
    return np.ascontiguousarray(out.T).view(np.uint64).ravel()


def filter_key(replication, seed=SEED):
    """Return the key of the filter of a trial."""
    return key_words(Streams(seed=seed).generator("design", replication, Purpose.FILTER))


def one_a_step(family):
    """Return what systematic resampling uses: the words of one counter a step, of 8 filters, over all steps."""
    key = [filter_key(number) for number in range(8)]
    rows = [[family(one, step, Draw.RESAMPLING, 0, 1) for step in range(COUNT)] for one in key]
    return np.array(rows).transpose(0, 2, 1).reshape(-1, COUNT)


@functools.cache
def counters_side_by_side(family, what):
    """Return words of counters and keys that differ in one respect, as the compiled filters use them."""
    own = filter_key(0)
    places = {
        "first word of the key": [((number, 0), 1, Draw.NORMALS) for number in range(STREAMS)],
        "second word of the key": [((0, number), 1, Draw.NORMALS) for number in range(STREAMS)],
        "replication": [(filter_key(number), 1, Draw.NORMALS) for number in range(STREAMS)],
        "step": [(own, number, Draw.NORMALS) for number in range(STREAMS)],
        "draw": [(own, number // len(Draw), Draw(number % len(Draw))) for number in range(STREAMS)],
    }
    return one_a_step(family) if what == "one a step" else np.array([family(*place) for place in places[what]])


COUNTER_VARIED = ("first word of the key", "second word of the key", "replication", "step", "draw", "one a step")


@pytest.mark.parametrize("what", COUNTER_VARIED)
def test_counters_are_even_independent_and_apart(what):
    """Words of other keys, trials, steps and purposes: six checks of a false-alarm rate of 5e-9 each."""
    assert alarms(counters_side_by_side(counter_words, what)) == {}


def without_step(key, step, draw, first=0, blocks_wanted=COUNT // 2):
    """The step is left out of the counter."""
    return counter_words(key, 0, draw, first, blocks_wanted)


def without_draw(key, step, draw, first=0, blocks_wanted=COUNT // 2):
    """The purpose is left out of the counter."""
    return counter_words(key, step, Draw.NORMALS, first, blocks_wanted)


def half_a_key(key, step, draw, first=0, blocks_wanted=COUNT // 2):
    """The second word of the key is left out."""
    return counter_words((key[0], 0), step, draw, first, blocks_wanted)


def running_index(key, step, draw, first=0, blocks_wanted=COUNT // 2):
    """The step shifts the index: each step goes over most of what the step before has used."""
    return counter_words(key, 0, draw, first + 8 * step, blocks_wanted)


def three_rounds(key, step, draw, first=0, blocks_wanted=COUNT // 2):
    """Philox with three of its ten rounds."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(counter_normals, "ROUNDS", 3)
        words = counter_normals.philox_words(key, step, draw, blocks_wanted)
    return np.ascontiguousarray(words.T).view(np.uint64).ravel()


COUNTER_POWER = [
    *((without_step, "step", check) for check in FORGOTTEN),
    *((without_draw, "draw", check) for check in FORGOTTEN),
    *((half_a_key, "second word of the key", check) for check in FORGOTTEN),
    (without_step, "one a step", uniform),
    (running_index, "step", uncorrelated),
    (running_index, "step", no_overlap),
    (three_rounds, "step", independent_pairs),
    (three_rounds, "second word of the key", unlike_bits),
]


@pytest.mark.parametrize(("family", "what", "check"), COUNTER_POWER, ids=name_of)
def test_the_checks_see_broken_counters(family, what, check):
    """A step, a purpose or half a key left out, indices that run on, too few rounds: each is an alarm."""
    assert check(counters_side_by_side(family, what)) < FALSE_ALARM


def test_no_two_counters_give_the_same_block():
    """64 steps, all purposes and 512 indices, 131 072 blocks of 128 bits under one key: all distinct."""
    found = [counter_words(filter_key(0), step, draw, 0, 512) for step in range(64) for draw in Draw]
    words = np.array(found).reshape(-1, 2)
    assert distinct(words.T) == len(words) == 64 * len(Draw) * 512


def test_filters_of_many_trials_have_keys_of_their_own():
    """4000 trials, no key of 64 bits twice: a chance below n² / 2^65, 4.3e-13, and for a million trials 2.7e-8.

    Should it ever happen, two trials share the draws of their filters, and still neither route nor odometry.
    """
    keys = [filter_key(number % 1000, seed=number // 1000) for number in range(4000)]
    assert len(set(keys)) == len(keys)


def odometry_noise():
    """Return the noise of the odometry of 32 trials, as drives draw it."""
    return np.array(
        [
            Streams(seed=SEED).generator("design", number, Purpose.ODOMETRY).standard_normal(NORMALS)
            for number in range(STREAMS)
        ]
    )


def filter_noise():
    """Return the noise of the particles of 32 trials in their first step, as compiled filters draw it."""
    width = blocks(NORMALS)
    words, out = np.empty((4, width), np.uint32), np.empty((STREAMS, 4, width), np.float32)
    for number in range(STREAMS):
        counter_normals_kernels.normals(*filter_key(number), 1, words, out[number])
    return out.reshape(STREAMS, -1)


def sums_of_twelve():
    """Return sums of twelve uniform numbers less six: as good as normal to the eye."""
    return np.random.Generator(np.random.Philox(SEED)).random((12, STREAMS * NORMALS)).sum(axis=0) - 6.0


def coarse():
    """Return normal numbers whose radius comes from 8 bits."""
    radius, angle = np.random.Generator(np.random.Philox(SEED)).random((2, STREAMS * NORMALS))
    return np.sqrt(-2.0 * np.log((np.floor(radius * 256.0) + 0.5) / 256.0)) * np.cos(2.0 * np.pi * angle)


@pytest.mark.parametrize("noise", [odometry_noise, filter_noise])
def test_noise_is_normal(noise):
    """Half a million numbers of 32 trials: cells, moments and tails (false-alarm rate 5e-9)."""
    assert normal(noise()) > FALSE_ALARM


@pytest.mark.parametrize("noise", [sums_of_twelve, coarse])
def test_what_only_looks_normal_is_seen(noise):
    """Sums of uniform numbers, whose tails end too early, and a radius of too few bits."""
    assert normal(noise()) < FALSE_ALARM


def test_the_noise_of_odometry_and_of_filters_is_independent():
    """Of 16 trials, those of one among them: two checks of a false-alarm rate of 5e-9 each."""
    words = words_of(np.concatenate([odometry_noise()[:16, :COUNT], filter_noise()[:16, :COUNT]]))
    assert uncorrelated(words) > FALSE_ALARM
    assert independent_pairs(words) > FALSE_ALARM


def test_noise_that_a_filter_shares_with_the_odometry_is_seen():
    """A filter that drew from the stream of the odometry would know the errors that it has to find."""
    odometry = odometry_noise()[:16, :COUNT]
    assert uncorrelated(words_of(np.concatenate([odometry, odometry]))) < FALSE_ALARM


def test_the_false_alarms_of_this_file_add_up_to_a_million_to_one():
    """All checks that must not alarm: of words and counters, of noise, and three of streams broken elsewhere."""
    applications = len(CHECKS) * (len(VARIED) + len(COUNTER_VARIED)) + 2 + 2 + 3
    # Twice, because that far out the normal and chi-square approximations are good to some tens of per cent.
    assert 2.0 * applications * FALSE_ALARM <= ALL_FALSE_ALARMS
