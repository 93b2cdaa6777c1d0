# only arm64
# The whole chain begins with an emulated sensor that plays a rendered room (the first disk), exactly.
plug rig_uvc_camera --frames /dev/vda --fps 4
check chain.frames rig_v4l $(node uvcvideo) grab 'Z16 ' 640 480 8 --frames /dev/vda
