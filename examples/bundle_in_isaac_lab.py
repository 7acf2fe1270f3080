"""Open an object of a bundle in Isaac Lab: python examples/bundle_in_isaac_lab.py FOLDER OBJECT (an unpacked bundle)

Runs in Isaac Lab's own Python (isaaclab.sh -p). Its authors had no machine that runs Isaac Lab: only the USD file that it loads
has been checked, without Isaac.
"""

import importlib.util
import sys
from pathlib import Path


def main(folder: str, name: str) -> None:
    asset = Path(folder).resolve() / "assets" / name / f"{name}.usda"
    if not asset.is_file():
        sys.exit(f"{asset}: there is no such object")
    if importlib.util.find_spec("isaaclab") is None:
        print("not run: Isaac Lab is not installed here (https://isaac-sim.github.io/IsaacLab)")
        return
    from isaaclab.app import AppLauncher

    launched = AppLauncher(headless=True)
    import isaaclab.sim as sim_utils
    from isaaclab.actuators import ImplicitActuatorCfg
    from isaaclab.assets import Articulation, ArticulationCfg

    simulation = sim_utils.SimulationContext(sim_utils.SimulationCfg(dt=0.01))
    sim_utils.GroundPlaneCfg().func("/World/ground", sim_utils.GroundPlaneCfg())
    held = ImplicitActuatorCfg(joint_names_expr=[".*"], stiffness=None, damping=None)  # gains from the file
    unit = Articulation(
        ArticulationCfg(prim_path="/World/unit", spawn=sim_utils.UsdFileCfg(usd_path=str(asset)), actuators={"joints": held})
    )
    simulation.reset()
    unit.write_joint_state_to_sim(unit.data.joint_pos_limits[..., 1], unit.data.joint_vel)  # open all joints
    for _ in range(100):
        unit.write_data_to_sim()
        simulation.step()
        unit.update(0.01)
    for joint, position in zip(unit.joint_names, unit.data.joint_pos[0].tolist(), strict=True):
        print(f"{joint}: {position:.2f}")
    launched.app.close()


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
