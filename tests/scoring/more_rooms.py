#!/usr/bin/env python3
"""More of what real rooms have, for the generator of random rooms that made the stills.

    python tests/scoring/more_rooms.py SCRIPTS       # a working copy of the stills' scripts, paths filled in as its README says
    SAMPLES=4 python SCRIPTS/stills2.py RAW 6000 6032 1 && python SCRIPTS/finish.py RAW OUT

Writes room2.py and stills2.py beside room.py and stills.py: dark on dark, white on white, gloss, picture frames and notice boards
low on walls, low cupboards and cases with plinths, free-standing cabinets, rugs, cables, tapes; cameras up to 1.5 m, tilts up to 46°,
rolls up to 8°, fields up to 84°; seeds of a stream of their own. The shipped weights saw seeds 6000 to 6029 and 6031. Stops where a piece that
it replaces is not there."""
import os
import sys

SCRIPTS = sys.argv[1]


def text_of(name):
    with open(os.path.join(SCRIPTS, name)) as file:
        return file.read()


def write(name, text):
    with open(os.path.join(SCRIPTS, name), "w") as file:
        file.write(text)


t = text_of('room.py')


def rep(old, new):
    global t
    if old not in t:
        sys.exit(f"{SCRIPTS}: no {old!r}: other scripts than this one knows")
    t = t.replace(old, new, 1)


# seeds of their own stream
rep("rg = np.random.default_rng(7000 + seed)", "rg = np.random.default_rng(770000 + seed); look = ('white', 'dark', 'pale', 'any', 'any', 'any')[rg.integers(6)]")
rep("wk = pick('white', 'white', 'white', 'colour', 'dado', 'dado', 'brick', 'wpanel', 'concrete')", "wk = pick('white', 'white', 'white', 'colour', 'dado', 'dado', 'brick', 'wpanel', 'concrete'); wk = {'white': 'white', 'pale': pick('white', 'concrete'), 'dark': pick('colour', 'wpanel', 'dado', 'concrete')}.get(look, wk)")
rep("gloss = U(.07, .2) if B(.45) else U(.3, .6)", "gloss = U(.05, .2) if B(.55) else U(.3, .6); fk = {'white': pick('vinyl', 'tile', 'vinyltile', 'terrazzo'), 'pale': pick('vinyl', 'concrete', 'tile'), 'dark': pick('carpet', 'tile', 'planks', 'vinyl')}.get(look, fk)")
rep("if fk == 'vinyl': fl = vinyl('f', J(pick(", "if fk == 'vinyl' and look in ('white', 'pale'): fl = vinyl('f', J(pick((.62, .62, .6), (.7, .69, .66), (.55, .56, .55))), gloss)\n    elif fk == 'vinyl' and look == 'dark': fl = vinyl('f', J(pick((.1, .11, .12), (.16, .12, .1), (.07, .08, .07))), gloss)\n    elif fk == 'tile' and look in ('white', 'dark'): tt = U(.2, .6); cc = (.66, .65, .63) if look == 'white' else (.1, .1, .1); fl = f_tile(J(cc), J(cc, .12), pick((.3, .29, .28), (.6, .6, .58), (.04, .04, .04)), tt, tt, U(.002, .006), gloss, pick(0, .5), pick(0, 0, math.pi / 4))\n    elif fk == 'vinyl': fl = vinyl('f', J(pick(")
rep("sk_k = pick('none', 'white', 'white', 'dark', 'dark', 'wood')", "sk_k = pick('none', 'white', 'white', 'dark', 'dark', 'wood'); sk_k = {'white': pick('white', 'white', 'none'), 'dark': pick('dark', 'dark', 'wood', 'none')}.get(look, sk_k)")
rep("leaf = pick(*leafs)", "leaf = leafs[0] if look == 'white' else pick(*leafs); blk = plain('blk', J((.02, .02, .025)), U(.15, .5)); cork = plain('cork', J((.42, .28, .16)), .9, 0, .2, 30); rugm = [carpet('rug%d' % q, J(c_)) for q, c_ in enumerate(((.3, .08, .07), (.08, .1, .2), (.4, .36, .3), (.05, .05, .05)))]")
rep("'rad', 'bin', 'chair', 'plant']", "'rad', 'bin', 'chair', 'plant', 'frame', 'frame', 'board', 'low', 'low', 'case']")
rep("            elif k == 'rad':", """            elif k in ('frame', 'board'):
                w, z, h = (U(.2, .8), U(.5, 1.5), U(.25, .7)) if k == 'frame' else (U(.7, 2.), U(.6, 1.), U(.6, 1.1))
                if room < w + .1: x += .4; continue
                m = P + a * (x + w / 2); bd = U(.02, .06); fm_ = pick(blk, s.white, oak, s.metal, beech); s.box(tuple(m + inn * .012), (w, .022), z, z + h, fm_, ang); s.box(tuple(m + inn * .016), (w - 2 * bd, .018), z + bd, z + h - bd, pick(wh, cork, poster('po', int(rg.integers(9))), blk, grey), ang, None, 0)
                if k == 'board':
                    for _ in range(int(rg.integers(2, 8))): pw = pick(.21, .3, .15); ph_ = pw * 1.4; s.box(tuple(P + a * (x + U(.1, max(.11, w - .1))) + inn * .027), (pw, .002), z + U(.05, max(.06, h - ph_ - .05)), 0, wh, ang, None, 0) if False else s.box(tuple(P + a * (x + U(.15, max(.16, w - .15))) + inn * .0265), (pw, .002), z + .08, z + min(h - .05, .08 + ph_), pick(wh, wh, beech, grey), ang, None, 0)
                elif B(.4): s.box(tuple(m + inn * .016), (w - 4 * bd, .02), z + 2 * bd, z + h - 2 * bd, pick(poster('po', int(rg.integers(9))), grey, navy), ang, None, 0)
                x += w + U(.05, .6)
            elif k in ('low', 'case'):
                w, dp, h = (U(.6, 1.6), U(.3, .55) if corrW > 2.1 else U(.2, .32), U(.4, .95)) if k == 'low' else (U(.4, 1.2), U(.25, .4) if corrW > 2.1 else U(.2, .3), U(1.2, 2.))
                if room < w + .1: x += .4; continue
                c = P + a * (x + w / 2) + inn * (dp / 2 + tk + .002); mt = pick(blk, blk, navy, grey, wh, oak, beech); r_ = math.atan2(inn[1], inn[0]) + math.pi / 2
                if B(.6): s.cabinet(tuple(c), (w, dp), h, mt, r_, U(.0, .06), U(.04, .14), pick(None, None, blk, grey, wh), int(rg.integers(1, 4)))
                else: s.box(tuple(c), (w, dp), 0, h, mt, r_, 'furniture')
                obst.append((c, max(w, dp) / 2 + .05)); x += w + U(.05, .8)
            elif k == 'rad':""")
rep("    # ---------------- light\n", """    # ---------------- rugs, cables, tapes, a free-standing dark cabinet
    for _ in range(int(pick(0, 0, 1, 1, 2))):
        p = spot(.5)
        if p is None: continue
        w, d = U(.5, 1.6), U(.4, 1.); s.box(tuple(p), (w, d), 0, U(.004, .012), pick(*rugm), pick(0, math.pi / 2, U(0, 3)), None, .001)
    for _ in range(int(pick(0, 1, 1, 2, 3))):
        p = U(lo, hi)
        if not inside(p): continue
        th = U(0, 6.28); m_ = pick(blk, s.dark, wh, rugm[0], s.tape); w_ = pick(.008, .012, .05)
        for _ in range(int(rg.integers(3, 14))):
            q2 = p + .25 * V2(math.cos(th), math.sin(th))
            if not inside(q2): break
            s.box(tuple((p + q2) / 2), (.26, w_), 0, .002 if w_ > .02 else w_ * .8, m_, th, None, 0); p = q2; th += U(-.5, .5) if w_ < .02 else 0
    for _ in range(int(pick(0, 0, 1, 1, 2))):
        p = spot(.5)
        if p is None: continue
        w, d, h = U(.4, 1.3), U(.3, .6), U(.3, 1.3); mt = pick(blk, blk, navy, grey, wh, oak); r_ = U(0, 3.14)
        if B(.4): s.cabinet(tuple(p), (w, d), h, mt, r_, U(.0, .06), U(.04, .14), pick(None, blk, grey), int(rg.integers(1, 4)))
        else: s.box(tuple(p), (w, d), 0, h, mt, r_, 'furniture')
        obst.append((p, max(w, d) / 2 + .1))
    # ---------------- light
""")
t = t.replace("kind=kind, light=light", "kind=kind, look=look, light=light")
write('room2.py', t)
t = text_of('stills.py')
rep("from room import *", "from room2 import *")
rep("big = rg.random() < .13", "big = rg.random() < .04")
rep("fov = U(40, 62) if dist else U(40, 75)", "fov = U(40, 62) if dist else U(40, 84)")
rep("U(math.log(.15), math.log(1.4))", "U(math.log(.15), math.log(1.5))")
rep("if hc > .9: tilt = max(tilt, U(6, 25))", "if hc > .8: tilt = [U(0, 8), U(6, 25), U(20, 46)][rg.integers(3)]")
rep("round(U(-3, 3), 3)", "round(U(-3, 3) if hc < .8 else U(-8, 8), 3)")
rep("c.max_bounces = 3; c.diffuse_bounces = 3", "c.max_bounces = 3; c.diffuse_bounces = 2")
rep("default_rng(90000 + seed)", "default_rng(9900000 + seed)")
write('stills2.py', t)
