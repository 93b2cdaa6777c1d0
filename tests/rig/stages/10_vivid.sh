# vivid, the kernel's own test driver: every pixel format that a depth sensor may have, and faults by its controls.
V=$(node vivid)
check vivid.formats rig_v4l $V list
check vivid.y16 rig_v4l $V grab 'Y16 ' 640 360 3 --plain
check vivid.y16be rig_v4l $V grab 'Y16 -BE' 640 360 3 --plain
