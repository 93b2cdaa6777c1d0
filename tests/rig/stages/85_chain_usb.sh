# only arm64
# needs usb
# The whole chain: emulated sensor, Burin's driver, burin scan, a mesh; the mesh is compared with the room on the host. The sensor waits
# for its reader (bulk transfers), so that an emulated processor keeps up.
plug rig_ps1080 --frames /dev/vda --fps 3 --hold 2
RIG_LIMIT=150 check chain.scan burin scan usb: -o /tmp/scan --voxel 0.02 --no-bilateral --seconds 10 --threads 1 --lossless --quiet
hand_out chain.mesh /tmp/scan
