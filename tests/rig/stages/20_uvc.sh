# A UVC depth camera through uvcvideo: each format in bulk, then isochronous; metadata; the extension unit.
plug rig_uvc_camera
D=$(node uvcvideo 0 0) I=$(node uvcvideo 0 2) C=$(node uvcvideo 3 0) M=$(node uvcvideo 0 1)
check uvc.formats rig_v4l $D list
check uvc.bulk.z16 rig_v4l $D grab 'Z16 ' 640 480 10
check uvc.bulk.y16 rig_v4l $D grab 'Y16 ' 640 480 5
check uvc.bulk.y10 rig_v4l $D grab 'Y10 ' 320 240 5
check uvc.bulk.y12 rig_v4l $D grab 'Y12 ' 320 240 5
check uvc.bulk.inzi rig_v4l $D grab INZI 640 480 3
check uvc.bulk.grey rig_v4l $I grab GREY 640 480 5
check uvc.bulk.y8i rig_v4l $I grab 'Y8I ' 320 240 5
check uvc.bulk.y12i rig_v4l $I grab Y12I 320 240 5
check uvc.bulk.praa rig_v4l $I grab pRAA 320 240 5
check uvc.bulk.yuyv rig_v4l $C grab YUYV 640 480 5
check uvc.bulk.uyvy rig_v4l $C grab UYVY 320 240 5
check uvc.bulk.mjpg rig_v4l $C grab MJPG 640 480 5
check uvc.bulk.d4xx rig_v4l $M meta D4XX 10 $D
check uvc.bulk.uvch rig_v4l $M meta UVCH 10 $D
check uvc.xu.laser rig_v4l $D xu 4 78 00
check uvc.xu.table rig_v4l $D xu 1 14 00 ab cd 15 00 00 00 19 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00
plug rig_uvc_camera --payload 8192
check uvc.bulk.payloads rig_v4l $(node uvcvideo 0 0) grab 'Z16 ' 848 480 5
plug rig_uvc_camera --iso
D=$(node uvcvideo 0 0) I=$(node uvcvideo 0 2) C=$(node uvcvideo 3 0)
check uvc.iso.z16 rig_v4l $D grab 'Z16 ' 640 480 10
check uvc.iso.grey rig_v4l $I grab GREY 640 480 5
check uvc.iso.yuyv rig_v4l $C grab YUYV 640 480 5
