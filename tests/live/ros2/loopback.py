"""A DDS domain of one's own on loopback, for the programs here that let viwo listen to Cyclone DDS."""
import pathlib
import socket
import subprocess

HERE = pathlib.Path(__file__).resolve().parent
CONFIG = HERE.parents[2] / "configs/runs/viwo_live_ros2.yaml"
CYCLONE = {"CYCLONEDDS_URI": """<CycloneDDS><Domain Id='any'><General><Interfaces>
<NetworkInterface address='127.0.0.1' multicast='false'/></Interfaces>
<AllowMulticast>false</AllowMulticast></General>
<Discovery><LeaseDuration>2s</LeaseDuration><ParticipantIndex>auto</ParticipantIndex>
<MaxAutoParticipantIndex>20</MaxAutoParticipantIndex>
<Peers><Peer address='127.0.0.1'/></Peers></Discovery></Domain></CycloneDDS>"""}


def free_domain():
    """A domain, and what keeps it: it is a range of UDP ports, and who has the same port of TCP has it."""
    for domain in range(1, 90):
        lock = socket.socket()
        try:
            lock.bind(("127.0.0.1", 7400 + 250 * domain))
            lock.listen(1)
            return domain, lock
        except OSError:
            lock.close()
    raise SystemExit("no free domain")


def record(viwo, viwo_bag, config, bag, *assignments):
    """Makes the bag of what a simulated robot gives, beside its log."""
    log = str(bag.parent / "log")
    sets = [word for assignment in assignments for word in ("--set", assignment)]
    for words in ([viwo, "simulate", str(config), *sets, "--out", log], [viwo_bag, log, str(bag)]):
        subprocess.run(words, check=True, stdout=subprocess.DEVNULL)


def listening(viwo, domain, out):
    """The words of a run of viwo_live_ros2.yaml on loopback."""
    return [viwo, "run", str(CONFIG), "--out", str(out),
            "--set", f"sensors.ros0.domain_id={domain}",
            "--set", "sensors.ros0.interfaces=[127.0.0.1]",
            "--set", "sensors.ros0.peers=[127.0.0.1]"]
