# The whole chain: an emulated sensor plays a rendered room (the first disk).
plug rig_uvc_camera --frames /dev/vda --fps 4
check chain.frames rig_v4l $(node uvcvideo) grab 'Z16 ' 320 240 8 --frames /dev/vda
