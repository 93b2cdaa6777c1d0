# vivid, the kernel's own test driver: pixel formats as depth sensors and boards have them, and faults by its controls.
V=$(node vivid)
check vivid.grey rig_v4l $V grab GREY 640 360 3 --plain
check vivid.y10 rig_v4l $V grab 'Y10 ' 640 360 3 --plain
check vivid.y12 rig_v4l $V grab 'Y12 ' 640 360 3 --plain
check vivid.y16 rig_v4l $V grab 'Y16 ' 640 360 3 --plain
check vivid.y16be rig_v4l $V grab 'Y16 -BE' 640 360 3 --plain
check vivid.bayer8 rig_v4l $V grab GRBG 640 360 3 --plain
check vivid.bayer12 rig_v4l $V grab BG12 640 360 3 --plain
check vivid.bayer16 rig_v4l $V grab BYR2 640 360 3 --plain
check vivid.yuyv rig_v4l $V grab YUYV 640 360 3 --plain
rig_v4l $V set 'Percentage of Dropped Buffers' 30 >/dev/null
check vivid.dropped rig_v4l $V grab 'Y16 ' 640 360 20 --plain --gaps-at-least 1
rig_v4l $V set 'Percentage of Dropped Buffers' 0 >/dev/null
rig_v4l $V set 'Inject V4L2_BUF_FLAG_ERROR' 1 >/dev/null
check vivid.flagged rig_v4l $V grab 'Y16 ' 640 360 5 --plain --damaged 1 --flagged-at-least 1
rig_v4l $V set 'Inject VIDIOC_STREAMON Error' 1 >/dev/null
check_not vivid.streamon rig_v4l $V grab 'Y16 ' 640 360 1 --plain
rig_v4l $V set 'Inject VIDIOC_REQBUFS Error' 1 >/dev/null
check_not vivid.reqbufs rig_v4l $V grab 'Y16 ' 640 360 1 --plain
check vivid.again rig_v4l $V grab 'Y16 ' 640 360 3 --plain
