# only amd64
# PrimeSense PS1080 as OpenNI2's driver sees it.
plug rig_ps1080
check ps1080.openni.depth3 rig_openni 5 depth 3
check ps1080.openni.depth1 rig_openni 5 depth 1
check ps1080.openni.depth0 rig_openni 3 depth 0
check ps1080.openni.depth4 rig_openni 3 depth 4
check ps1080.openni.uyvy rig_openni 3 yuv 5
check ps1080.openni.yuyv rig_openni 3 yuv 7
check ps1080.openni.bayer rig_openni 3 grey 6
check ps1080.openni.yuv_compressed rig_openni 3 yuv 1
check ps1080.openni.bayer_compressed rig_openni 3 grey 0
check ps1080.openni.ir rig_openni 3 ir
check ps1080.openni.iso rig_openni 3 depth 3 iso
plug rig_ps1080 --firmware 5.4
check ps1080.openni.firmware54 rig_openni 3 depth 3
plug rig_ps1080 --firmware 5.1
check ps1080.openni.firmware51 rig_openni 3 depth 3
