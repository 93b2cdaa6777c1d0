# only amd64
# Faults of the emulators, as independent hosts take them: what is delivered is right, and streaming goes on.
plug rig_uvc_camera -f 'at 5 unplug'
check fault.uvc.unplug rig_v4l $(node uvcvideo) grab 'Z16 ' 640 480 100 --until-gone
plug rig_uvc_camera -f 'at 5 unplug 300'
check fault.uvc.unplug_again rig_v4l $(node uvcvideo) grab 'Z16 ' 640 480 100 --until-gone
check fault.uvc.replug rig_v4l $(node uvcvideo) grab 'Z16 ' 640 480 5
plug rig_uvc_camera --iso -f 'at 5 unplug'
check fault.uvc.unplug_iso rig_v4l $(node uvcvideo) grab 'Z16 ' 640 480 100 --until-gone
plug rig_uvc_camera -f 'at 3 short_frame 2'
check fault.uvc.short rig_v4l $(node uvcvideo) grab 'Z16 ' 640 480 8 --damaged 2 --gaps-at-least 1
plug rig_uvc_camera -f 'at 3 long_frame 1'
check fault.uvc.long rig_v4l $(node uvcvideo) grab 'Z16 ' 640 480 8 --damaged 2
plug rig_uvc_camera -f 'at 3 corrupt_header 1 1'
check fault.uvc.header1 rig_v4l $(node uvcvideo) grab 'Z16 ' 640 480 8 --damaged 2 --gaps-at-least 0
plug rig_uvc_camera --iso -f 'at 3 corrupt_header 5 255'
check fault.uvc.header255 rig_v4l $(node uvcvideo) grab 'Z16 ' 640 480 8 --damaged 2
plug rig_uvc_camera -f 'at 3 error_bit 1'
check fault.uvc.error_bit rig_v4l $(node uvcvideo) grab 'Z16 ' 640 480 8 --damaged 2
plug rig_uvc_camera -f 'at 3 no_end_of_frame 2'
check fault.uvc.no_end rig_v4l $(node uvcvideo) grab 'Z16 ' 640 480 8 --damaged 2
plug rig_uvc_camera -f 'at 3 stuck_frame_id 2'
check fault.uvc.stuck_id rig_v4l $(node uvcvideo) grab 'Z16 ' 640 480 8 --damaged 4
plug rig_uvc_camera --iso -f 'at 3 lost_iso 40'
check fault.uvc.lost_iso rig_v4l $(node uvcvideo) grab 'Z16 ' 640 480 8 --damaged 4 --gaps-at-least 1
plug rig_uvc_camera -f 'at 3 silent always'
check_not fault.uvc.silent rig_v4l $(node uvcvideo) grab 'Z16 ' 640 480 100 --timeout 3
plug rig_kinect -f 'at 3 lost_iso 5'
check fault.kinect.lost_iso rig_freenect 8 depth11 --faulty
plug rig_kinect -f 'at 3 corrupt_magic 3'
check fault.kinect.magic rig_freenect 8 depth11 --faulty
plug rig_kinect -f 'at 3 short_packet 3'
check fault.kinect.short rig_freenect 8 depth11 --faulty
plug rig_kinect -f 'at 3 corrupt_type 3 23'
check fault.kinect.type rig_freenect 8 depth11 --faulty
plug rig_kinect -f 'at 3 runt_packet 3 5'
check fault.kinect.runt rig_freenect 8 depth11 --faulty
plug rig_kinect -f 'at 4 unplug'
check_not fault.kinect.unplug rig_freenect 100 depth11
plug rig_kinect -f 'empty_reply 3'
check fault.kinect.empty_reply rig_freenect 5 depth11
plug rig_ps1080 -f 'at 3 lost_packet 2'
check fault.ps1080.lost rig_openni 8 depth 3
plug rig_ps1080 -f 'at 3 corrupt_magic 2'
check fault.ps1080.magic rig_openni 8 depth 3
plug rig_ps1080 -f 'at 3 corrupt_number 2'
check fault.ps1080.number rig_openni 8 depth 3
plug rig_ps1080 -f 'empty_reply 3'
check fault.ps1080.empty_reply rig_openni 3 depth 3
