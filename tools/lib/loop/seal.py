# SPDX-License-Identifier: Apache-2.0
"""seal.py TWIN HIDDEN SEED OUT: writes the camera file TWIN with two imperfections drawn from HIDDEN to OUT."""
import random
import sys
import tomllib


def drawn(value, chance):
    """A number as it is, or one evenly between the two of a list; four digits, as a person would write it."""
    return float(f"{chance.uniform(*value):.4g}") if isinstance(value, list) else value


def sealed(twin, hidden, seed):
    """Text of the camera file with two imperfections more. The nonce keeps its hash from being looked up."""
    chance = random.Random(seed)
    chosen = sorted(chance.sample(range(len(hidden)), 2))
    text = f"# nonce {random.SystemRandom().getrandbits(128):032x}\n{twin}"
    for number in chosen:
        text += f'\n[[effect]]\ntype = "{hidden[number]["type"]}"\n'
        for key, value in hidden[number].items():
            if key not in ("type", "words", "found"):
                text += f"{key} = {drawn(value, chance)}\n"
    return text


def main():
    twin, hidden, seed, out = sys.argv[1:]
    with open(twin, encoding="utf-8") as file:
        declared = file.read()
    with open(hidden, "rb") as file:
        choices = tomllib.load(file)["imperfection"]
    with open(out, "w", encoding="utf-8") as file:
        file.write(sealed(declared, choices, seed))


if __name__ == "__main__":
    main()
