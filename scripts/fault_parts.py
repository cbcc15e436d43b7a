"""What faults of log folders are made of: which rows they are in, and what happens to these."""
import math
import sys

NS = 10**9
GYRO, ACCEL, DRIVE, STEER = 'w_RS_S', 'a_RS_S', 'drive_', 'steer_'


class Table:
    """Rows of text, the first field a stamp in ns, and where in time the fault is."""

    def __init__(self, text, at_s, rng):
        lines = text.splitlines()
        self.header = lines[0]
        self.names = [name.strip() for name in lines[0].split(',')]
        self.rows = [line.split(',') for line in lines[1:] if line.strip()]
        self.rng = rng
        self.begin = int(self.rows[0][0])
        self.end = int(self.rows[-1][0])
        after = (self.end - self.begin) // 2 if at_s is None else round(at_s * NS)
        self.at = self.begin + after
        self.period = (self.end - self.begin) // max(1, len(self.rows) - 1)
        self.first = next((i for i, row in enumerate(self.rows) if int(row[0]) >= self.at), None)
        if self.first is None:
            sys.exit(f'--at is {after / NS} s, the table has '
                     f'{(self.end - self.begin) / NS} s')

    def columns(self, *prefixes):
        found = [i for i, name in enumerate(self.names) if name.startswith(prefixes)]
        if not found:
            sys.exit(f'no column {" or ".join(prefixes)} in the table')
        return found

    def text(self):
        return '\n'.join([self.header] + [','.join(row) for row in self.rows]) + '\n'


# When: which rows a fault is in.

def always(table, row):
    return True


def afterwards(table, row):
    return int(row[0]) >= table.at


def during(seconds):
    return lambda table, row: table.at <= int(row[0]) < table.at + int(seconds * NS)


def sometimes(part):
    return lambda table, row: table.rng.random() < part


# What happens to these rows.

def gone(when):
    def put(table):
        table.rows = [row for row in table.rows if not when(table, row)]
    return put


def numbers(prefix, change, when=always, which=None):
    """change(value, table, row) of the columns that begin so, or only the `which`th of them."""
    def put(table):
        columns = table.columns(prefix)
        if which is not None:
            columns = [columns[which]]
        for row in table.rows:
            if when(table, row):
                for i in columns:
                    row[i] = repr(float(change(float(row[i]), table, row)))
    return put


def times(factor):
    return lambda value, table, row: factor * value


def plus(offset):
    return lambda value, table, row: value + offset


def plus_or_minus(offset):
    return lambda value, table, row: value + table.rng.choice((-offset, offset))


def now_and_then(part, change):
    return lambda value, table, row: (
        change(value, table, row) if table.rng.random() < part else value)


def clipped(limit):
    return lambda value, table, row: max(-limit, min(limit, value))


def exchanged(prefix, a, b):
    def put(table):
        columns = table.columns(prefix)
        i, j = columns[a], columns[b]
        for row in table.rows:
            row[i], row[j] = row[j], row[i]
    return put


def field(prefix, which, change):
    """One field of the row where the fault begins; change(text) is its new text."""
    def put(table):
        i = table.columns(prefix)[which]
        table.rows[table.first][i] = change(table.rows[table.first][i])
    return put


def text(value):
    return lambda _: value


def letter(number):
    return number[:2] + 'x' + number[3:]


def stamps(change, when=always):
    """change(stamp, table) of the rows."""
    def put(table):
        for row in table.rows:
            if when(table, row):
                row[0] = str(change(int(row[0]), table))
    return put


def later(seconds):
    return lambda stamp, table: stamp + round(seconds * NS)


def one_stamp(change):
    """All rows of the instant where the fault begins: the points of an image have one stamp."""
    def put(table):
        stamp = table.rows[table.first][0]
        stamps(change, lambda _, row: row[0] == stamp)(table)
    return put


def jittered(stamp, table):
    return stamp + table.rng.randrange(-table.period // 2 + 1, table.period // 2)


def in_bursts(hold_s, every_s):
    """A bus that is held up: stamps are those of arrival, a tenth of a period apart."""
    def put(table):
        hold, every = int(hold_s * NS), int(every_s * NS)
        last = None
        for row in table.rows:
            stamp = int(row[0])
            phase = (stamp - table.begin) % every
            arrival = stamp - phase + every if phase >= every - hold else stamp
            if last is not None:
                arrival = max(arrival, last + table.period // 10)
            last = arrival
            row[0] = str(arrival)
    return put


def repeated(when):
    """The block of these rows a second time, directly after itself."""
    def put(table):
        block = [row for row in table.rows if when(table, row)]
        end = table.rows.index(block[-1]) + 1
        table.rows[end:end] = [list(row) for row in block]
    return put


def twice(when):
    def put(table):
        table.rows = [row for row in table.rows for _ in range(2 if when(table, row) else 1)]
    return put


def out_of_order(table):
    i = table.first
    table.rows[i], table.rows[i + 1] = table.rows[i + 1], table.rows[i]


def cut_off(table):
    """What a logger leaves that is switched off while it writes."""
    whole = table.text().rstrip('\n')
    return whole[:whole.rindex(',') + 2]


def stuck(when):
    def put(table):
        kept = table.rows[table.first][1:]
        for row in table.rows:
            if when(table, row):
                row[1:] = kept
    return put


def spoilt(part):
    """IMU samples, each as a whole, as by transfers that are disturbed."""
    def put(table):
        wrong = {id(row) for row in table.rows if table.rng.random() < part}
        for prefix, off in ((GYRO, 5), (ACCEL, 50)):
            numbers(prefix, plus_or_minus(off), lambda _, row: id(row) in wrong)(table)
    return put


# Points of images: timestamp_ns, camera, id, u, v; an image without points has empty fields.

def images(table, rows=None):
    """Rows by (stamp, camera), in their order."""
    found = {}
    for row in table.rows if rows is None else rows:
        found.setdefault((row[0], row[1]), []).append(row)
    return found


def dark(when):
    def put(table):
        table.rows = [row for (stamp, camera), points in images(table).items() for row in
                      ([[stamp, camera, '', '', '']] if when(table, points[0]) else points)]
    return put


def frozen(when):
    def put(table):
        stamp = table.rows[table.first][0]
        kept = {camera: points for (t, camera), points in images(table).items() if t == stamp}
        table.rows = [row for (t, camera), points in images(table).items() for row in
                      ([[t] + point[1:] for point in kept.get(camera, [])]
                       if when(table, points[0]) else points)]
    return put


def points(change, when=always):
    """change(u, v, table, row, width, height) of points; the size is that of what is in use."""
    def put(table):
        seen = [row for row in table.rows if row[2] != '']
        width, height = (max(float(row[i]) for row in seen) for i in (3, 4))
        for row in seen:
            if when(table, row):
                uv = change(float(row[3]), float(row[4]), table, row, width, height)
                row[3:5] = [repr(float(x)) for x in uv]
    return put


def anywhere(u, v, table, row, width, height):
    return table.rng.uniform(0, width), table.rng.uniform(0, height)


def swinging(u, v, table, row, width, height):
    if int(row[2]) % 2 == 0:
        return u, v
    return u + 15 * math.sin(0.8 * (int(row[0]) - table.begin) / NS), v


def exchanged_ids(part):
    def put(table):
        for seen in images(table, [row for row in table.rows if row[2] != '']).values():
            for _ in range(round(part / 2 * len(seen))):
                a, b = table.rng.sample(seen, 2)
                a[2], b[2] = b[2], a[2]
    return put


def cameras_exchanged(table):
    for row in table.rows:
        row[1] = str(1 - int(row[1]))
    table.rows.sort(key=lambda row: (int(row[0]), int(row[1])))


def both(*puts):
    def put(table):
        for one in puts:
            one(table)
    return put
