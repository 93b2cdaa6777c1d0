# Kinect v1 as the kernel's driver and libfreenect see it.
plug rig_kinect
check kinect.gspca rig_v4l $(node kinect) grab Y10B 640 480 5
check kinect.freenect.depth11 rig_freenect 8 depth11
check kinect.freenect.depth10 rig_freenect 5 depth10
check kinect.freenect.bayer rig_freenect 5 bayer
check kinect.freenect.uyvy rig_freenect 5 uyvy
check kinect.freenect.ir rig_freenect 5 ir
check kinect.freenect.both rig_freenect 5 both
check kinect.freenect.motor rig_freenect 0 motor
check kinect.freenect.mm rig_freenect 3 mm
plug rig_kinect --still 7
check kinect.freenect.registered rig_freenect 3 registered --save /tmp/kinect_registered.u16
