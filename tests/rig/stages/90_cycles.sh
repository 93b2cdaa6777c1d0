# asked
# Opened, started, stopped and closed 10,000 times, 1000 where opening takes a hundred requests: nothing grows (an image may be lost now and then on the way down).
# Memory that the allocator keeps for each thread would count as lost.
export GLIBC_TUNABLES=glibc.malloc.tcache_count=0
RIG_LIMIT=1800 check cycles.vivid rig_client v4l2:$(node vivid) 0 --depth-format Y16 --size 640x360 --plain --damaged 200 --cycles 10000
plug rig_uvc_camera
RIG_LIMIT=1800 check cycles.uvc rig_client v4l2:$(node uvcvideo 0 0) 0 --damaged 200 --cycles 10000
plug rig_ps1080
RIG_LIMIT=1800 check cycles.usb rig_client usb: 0 --damaged 200 --cycles 1000
unset GLIBC_TUNABLES
