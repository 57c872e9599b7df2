"""How long wisp takes to end after SIGTERM, by the stage that it is in.

    python3 tools/measure/stopping.py WISP [DIRECTORY] [--only NAMES] [--longest SECONDS]

Makes scenes that are long in one stage or another, and renders each several times with the signal sent after more and more
seconds. Prints a table: stage, the worst seconds from the signal to the end, scene and moment of it, and how many signals
fell into that stage. Beside it is said: an end by anything but the signal's status, a file left behind, and what was done. DIRECTORY
(default: build/stopping) keeps the scenes.
"""
import argparse
import math
import os
import random
import re
import signal
import struct
import subprocess
import sys
import threading
import time

moments = (0.1, 0.3, 0.6, 1.0, 1.5, 2.2, 3.0, 4.0, 6.0, 9.0)
view = 'v\nfrom 4 -9 3\nat 0 0 0\nup 0 0 1\nangle 30\nhither 0.1\nresolution {} {}\n'
lamp = 'l 6 -6 8 1 1 1\n'


def write_grid(path, n):
    generator = random.Random(7)
    layer = [generator.random() for _ in range(n * n)]
    with open(path, 'wb') as out:
        out.write(b'VOL\x03' + struct.pack('<5i6f', 1, n, n, n, 1, -2, -2, -2, 2, 2, 2))
        for z in range(n):
            first = generator.randrange(n * n)
            out.write(struct.pack(f'<{n * n}f', *(layer[first:] + layer[:first])))


def write_particles(path, count):
    generator = random.Random(11)
    with open(path, 'wb') as out:
        out.write(f'ply\nformat binary_little_endian 1.0\nelement vertex {count}\nproperty float x\nproperty float y\n'
                  'property float z\nend_header\n'.encode())
        for first in range(0, count, 4096):
            some = min(4096, count - first)
            out.write(struct.pack(f'<{3 * some}f', *(generator.uniform(-2, 2) for _ in range(3 * some))))


def write_mesh(path, count):
    side = math.isqrt(count // 2)
    with open(path, 'w') as out:
        out.write(view.format(400, 300) + 'l 6 -6 8\nl -6 -6 8\nl 0 0 9\nf 0.6 0.5 0.4 0.8 0.2 10 0 1\n')
        height = lambda i, j: 0.3 * math.sin(0.37 * i) * math.cos(0.29 * j)
        for i in range(side):
            for j in range(side):
                for corners in (((i, j), (i + 1, j), (i + 1, j + 1)), ((i, j), (i + 1, j + 1), (i, j + 1))):
                    out.write('p 3\n')
                    for x, y in corners:
                        out.write(f'{4 * x / side - 2:.5f} {4 * y / side - 2:.5f} {height(x, y):.5f}\n')


def write_scenes(folder):
    """name -> words of `wisp`. Large files are made once."""
    os.makedirs(folder, exist_ok=True)
    place = lambda name: os.path.join(folder, name)
    for name, make, size in (('noise.vol', write_grid, 300), ('cloud.ply', write_particles, 2000000),
                             ('mesh.nff', write_mesh, 400000)):
        if not os.path.exists(place(name)):
            make(place(name) + '.part', size)
            os.rename(place(name) + '.part', place(name))
    generator = random.Random(5)
    lamps = ''.join('l {:.3f} {:.3f} {:.3f}\n'.format(*(generator.uniform(-6, 6) for _ in range(3))) for _ in range(20000))
    mesh = open(place('mesh.nff')).read().split('f ', 1)[1]
    texts = {
        'thick': view.format(200, 200) + lamp + 'smoke box -20 -20 0 20 20 400 1 { albedo 1 1 1 }\n',
        'grid': view.format(200, 200) + lamp + 'smoke noise.vol { extinction 3 albedo 0.9 0.8 0.7 phase 0.3 }\n',
        'cloud': view.format(200, 200) + lamp + 'smoke cloud.ply { radius 0.03 mass 0.00001 extinction 4 }\n',
        'soot': view.format(200, 200) + lamp + 'smoke cloud.ply { radius 0.03 mass 0.00001 extinction 4000 }\n',
        'wide': view.format(200, 200) + lamp + 'smoke cloud.ply { radius 0.3 mass 0.00001 extinction 4 }\n',
        'empty': view.format(200, 200) + lamp,
        'dense': view.format(200, 200) + lamp + 'smoke box -1 -1 -1 1 1 1 500 { albedo 1 1 1 }\n',
        'lamps': view.format(200, 200) + lamps + 'f 0.6 0.5 0.4 0.8 0.2 10 0 1\n'
                 'p 4\n-2 -2 0\n2 -2 0\n2 2 0\n-2 2 0\n',
        'room': view.format(200, 200) + ''.join(lamps.splitlines(True)[:40]) + 'f ' + mesh,
    }
    for name, text in texts.items():
        with open(place(name + '.aff'), 'w') as out:
            out.write(text)
    runs = {
        'thick box': 'thick.aff', 'thick box, fixed': 'thick.aff --arith fixed', 'thick box, direct': 'thick.aff --smoke direct',
        'grid': 'grid.aff --photons 3000000', 'grid, fixed': 'grid.aff --arith fixed',
        'grid, adaptive': 'grid.aff --irradiance adaptive --photons 10000',
        'grid, direct': 'grid.aff --smoke direct', 'grid, direct adaptive': 'grid.aff --smoke direct --irradiance adaptive',
        'grid, exact': 'grid.aff --density-step 0',
        'grid, reference': 'grid.aff --reference',
        'particles': 'cloud.aff', 'particles, direct': 'cloud.aff --smoke direct',
        'particles, map': 'cloud.aff --deposit exact --photons 100000',
        'particles, adaptive': 'cloud.aff --smoke direct --irradiance adaptive --photons 200000',
        'wide particles, direct': 'wide.aff --smoke direct --photons 20000',
        'wide particles, map': 'wide.aff --deposit kernel --photons 20000',
        'dense box, direct': 'dense.aff --smoke direct', 'dense box': 'dense.aff', 'dense box, reference': 'dense.aff --reference',
        'lamps, cuts': 'lamps.aff --lights cuts', 'lamps': 'lamps.aff',
        'one pixel of a thick box': 'thick.aff --size 1x1', 'soot': 'soot.aff',
        'large picture': 'empty.aff --size 6000x4000 --spp 1 -o out.png',
    }
    for shadows in ('trace', 'exact', 'lie', 'voxel', 'lightbuffer', 'paper'):
        runs['mesh, ' + shadows] = 'mesh.nff --shadows ' + shadows
        runs['room, ' + shadows] = 'room.aff --shadows ' + shadows
    kitchen = os.path.abspath(os.path.join(os.environ.get('DATA') or '../shared/data', 'bart/kitchen/kitchen.aff'))
    if os.path.exists(kitchen):
        for shadows in ('lie', 'lightbuffer'):
            runs['Kitchen, ' + shadows] = f'{kitchen} --frames 10 --shadows {shadows}'
    runs = {name: f'render {words} --progress always -o out.pfm' for name, words in runs.items()}
    return {**runs, 'plan': 'plan cloud.aff', 'inspect': 'inspect grid.aff 100 100 --progress always'}


class Run:
    """One process that is given a signal after `moment` seconds: stage, seconds to the end, and its status (-9: it would not end)."""

    def __init__(self, wisp, words, folder, moment, longest):
        output = os.path.join(folder, 'out.pfm')
        for left in os.listdir(folder):
            if left.startswith('out.'):
                os.remove(os.path.join(folder, left))
        self.said = ''
        process = subprocess.Popen([wisp] + words.split(), cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        reader = threading.Thread(target=self.read, args=(process.stderr,))
        reader.start()
        time.sleep(moment)
        self.over = process.poll() is not None
        stages = re.findall(r'frame \d+: (.*?) +\d+ %', self.said)
        self.stage = stages[-1] if stages else 'reading and preparing'
        start = time.monotonic()
        if not self.over:
            process.send_signal(signal.SIGTERM)
        timer = threading.Timer(longest, process.kill)
        timer.start()
        self.status = process.wait()
        self.seconds = time.monotonic() - start
        timer.cancel()
        reader.join()
        self.left = [name for name in os.listdir(folder) if name.startswith('out.')]

    def read(self, pipe):
        while data := os.read(pipe.fileno(), 65536):
            self.said += data.decode(errors='replace')


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument('wisp')
    parser.add_argument('folder', nargs='?', default='build/stopping')
    parser.add_argument('--only', default='', help='runs whose names begin so')
    parser.add_argument('--longest', type=float, default=60)
    parser.add_argument('--moments', type=lambda text: [float(x) for x in text.split(',')], default=moments)
    given = parser.parse_args()
    worst = {}
    for name, words in write_scenes(given.folder).items():
        if not name.startswith(given.only):
            continue
        for moment in given.moments:
            run = Run(os.path.abspath(given.wisp), words, given.folder, moment, given.longest)
            if run.over:
                break
            if run.status == 0:  # what was made is written
                fault = 'done'
            elif run.status == 128 + signal.SIGTERM and not run.left:
                fault = ''
            else:
                fault = f'status {run.status}, {run.left} left'
            print(f'{name}, {moment} s: {run.stage}, {run.seconds:.3f} s {fault}', file=sys.stderr, flush=True)
            before = worst.get(run.stage, (0, '', 0))
            worst[run.stage] = max(before[:2], (run.seconds, f'{name}, {moment} s {fault}')) + (before[2] + 1,)
    print('stage | worst seconds | where | signals')
    for stage, (seconds, where, count) in worst.items():
        print(f'{stage} | {seconds:.2f} | {where} | {count}')


main()
