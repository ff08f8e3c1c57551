"""An elastic arm: its sag under a load, and its natural frequencies."""

import numpy as np

import vgtsim
from vgtsim.description import Payload
from vgtsim.statics.elasticity import make_elastic_model
from vgtsim.statics.modes import find_modes
from vgtsim.statics.stiffness import deflect, settle, tip_compliance

arm = vgtsim.load_arm("arm15")
posture = vgtsim.solve_goal(arm, (9.0, 0.0, -5.0), (1.0, 0.0, 0.0))
tip = arm.truss.tip
print("payload, sag to first order, settled sag, slowest modes")
for mass in (0.0, 453.59237):
    model = make_elastic_model(arm, Payload(mass=mass, radius=0.15), 9.80665)
    first = deflect(model, posture.nodes).nodes[tip].mean(axis=0)[2]
    settled = settle(model, posture.nodes)
    sag = (settled - posture.nodes)[tip].mean(axis=0)[2]
    tones = find_modes(model, settled, 3).frequency
    print(f"{mass:6.1f} kg, {first:.4f} m, {sag:.4f} m, {', '.join(f'{tone:.2f}' for tone in tones)} Hz")

# A small force at the tip moves it as the compliance says.
model = make_elastic_model(arm, Payload(mass=0.0, radius=0.15), 9.80665)
compliance = tip_compliance(model, posture.nodes)
print(f"compliance of the tip along z: {1e6 * compliance[2, 2]:.3f} um/N")
print(f"it is symmetric: {1e6 * compliance[0, 2]:.6f} um/N, expected {1e6 * compliance[2, 0]:.6f} um/N")
print(f"and positive: {int(np.sum(np.linalg.eigvalsh(compliance) > 0))} directions, expected {len(compliance)}")
