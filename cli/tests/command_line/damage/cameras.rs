//! Camera files of other programs, each with the damage that its form can have.
use super::Kind;

/// Of each form one; the rig that names it is called as it is, with `.toml` behind.
pub(super) const CAMERAS: &[Kind] = &[
    Kind {
        name: "euroc.yaml",
        sound: "sensor_type: camera\nresolution: [320, 240]\ncamera_model: pinhole\nintrinsics: [365, 366, 146, 115]\n\
                distortion_model: radial-tangential\ndistortion_coefficients: [-0.2, 0.3, 0.001, 0.002]\n",
        command: "range --rig euroc.yaml.toml pixels.csv",
        damages: &[
            ("resolution: [320, 240]\n", "", &["`image_width` is missing", "width and height into [camera]"]),
            ("resolution: [320", "resolution: [320.5", &["320.5×240"]),
            ("intrinsics", "intrinsic", &["`intrinsic` is not a known entry", "`intrinsics`"]),
            ("146, 115", "146", &["`intrinsics` has 3 numbers"]),
            ("pinhole", "omni", &["`omni` is not supported"]),
            ("radial-tangential", "equidistant-x", &["`equidistant-x` is not supported"]),
            ("-0.2, 0.3, 0.001, 0.002", "-0.2, 0.3", &["2 coefficients"]),
            ("365, 366", "1e300, 366", &["`focal` is 1e300"]),
            ("365, 366", ".inf, 366", &["line 4", "non-finite"]),
        ],
    },
    Kind {
        name: "kalibr.yaml",
        sound: "cam0:\n  camera_model: pinhole\n  intrinsics: [365, 366, 146, 115]\n  distortion_model: radtan\n\
                \u{20} distortion_coeffs: [-0.2, 0.3, 0.001, 0.002]\n  resolution: [320, 240]\n  rostopic: /cam0\n",
        command: "range --rig kalibr.yaml.toml pixels.csv",
        damages: &[
            (
                "  intrinsics: [365, 366, 146, 115]\n",
                "",
                &["`camera_matrix` is missing", "`distortion_model`"],
            ),
            ("distortion_coeffs", "distortion_cofs", &["`distortion_cofs` is not a known entry"]),
            ("  resolution: [320, 240]\n", "", &["`image_width` is missing"]),
            ("pinhole", "ds", &["`ds` is not supported"]),
            ("365, 366", "0.9, 1.2", &["parts of the picture's width"]),
            ("  distortion_model", "distortion_model", &["not YAML", "line 5"]),
        ],
    },
    Kind {
        name: "orbslam.yaml",
        sound: "%YAML:1.0\nCamera.type: \"PinHole\"\nCamera.fx: 365.0\nCamera.fy: 366.0\nCamera.cx: 146.0\nCamera.cy: 115.0\n\
                Camera.k1: -0.2\nCamera.k2: 0.3\nCamera.p1: 0.001\nCamera.p2: 0.002\nCamera.width: 320\nCamera.height: 240\n",
        command: "range --rig orbslam.yaml.toml pixels.csv",
        damages: &[
            ("Camera.fx: 365.0\n", "", &["`Camera.fx` is missing"]),
            ("Camera.width: 320\n", "", &["`Camera.width` is missing"]),
            ("Camera.k1", "Camera.kk1", &["`Camera.kk1` is not known", "`k1` is missing", "k1: 0"]),
            ("Camera.p2: 0.002\n", "", &["`p2` is missing"]),
            ("365.0", "wide", &["`Camera.fx` does not hold finite numbers"]),
            ("366.0", ".nan", &["line 4", "non-finite"]),
            ("PinHole", "Rectified2", &["`Rectified2` is not supported"]),
        ],
    },
    Kind {
        name: "vins.yaml",
        sound: "model_type: PINHOLE\nimage_width: 320\nimage_height: 240\ndistortion_parameters:\n  k1: -0.2\n  k2: 0.3\n  p1: 0.001\n\
                \u{20} p2: 0.002\nprojection_parameters:\n  fx: 365\n  fy: 366\n  cx: 146\n  cy: 115\n",
        command: "range --rig vins.yaml.toml pixels.csv",
        damages: &[
            ("  fx: 365\n", "", &["`fx` is missing"]),
            ("  k2: 0.3", "  k9: 0.3", &["`k2` is missing"]),
            ("PINHOLE", "MEI", &["`MEI` is not supported"]),
            (
                "projection_parameters",
                "projecton_parameters",
                &["`projecton_parameters`: `image_width` is missing"],
            ),
            ("cx: 146", "cx: .inf", &["line 12", "non-finite"]),
        ],
    },
    Kind {
        name: "kitti.txt",
        sound: "calib_time: 09-Jan-2012 13:57:47\nS_rect_00: 320 240\nP_rect_00: 365 0 146 0 0 366 115 0 0 0 1 0\n",
        command: "range --rig kitti.txt.toml pixels.csv",
        damages: &[
            ("S_rect_00: 320 240\n", "", &["does not say the picture's size", "width and height"]),
            ("320 240", "320", &["`S_rect_00` holds 1 finite numbers, must hold 2"]),
            ("320 240", "0 240", &["0×240"]),
            ("365 0 146", "nan 0 146", &["`P_rect_00` holds 11 finite numbers, must hold 12"]),
            (" 0 0 0 1 0", "", &["`P_rect_00` holds 7 finite numbers, must hold 12"]),
            ("115 0", "115 x", &["`P_rect_00` holds 11 finite numbers"]),
            ("P_rect_00", "P_ract_00", &["`camera_matrix` is missing", "`P_ract_00`"]),
        ],
    },
    Kind {
        name: "ost.txt",
        sound: "[image]\n\nwidth\n320\n\nheight\n240\n\n[narrow_stereo]\n\ncamera matrix\n365 0 146\n0 366 115\n0 0 1\n\n\
                distortion\n-0.2 0.3 0.001 0.002 0\n\nrectification\n1 0 0\n0 1 0\n0 0 1\n",
        command: "range --rig ost.txt.toml pixels.csv",
        damages: &[
            ("height\n240\n", "", &["`image_height` is missing"]),
            ("320", "wide", &["`width` holds 0 numbers"]),
            ("0 0 1\n\ndist", "dist", &["`camera_matrix` has 6 numbers, must have 9"]),
            ("distortion", "distorsion", &["`distorsion` is not a known entry", "`distortion`"]),
            ("365 0 146", "nan 0 146", &["`camera_matrix` does not hold finite numbers"]),
            ("-0.2 0.3", "-0.2 x", &["line 17 holds `x`"]),
        ],
    },
    Kind {
        name: "opencv.xml",
        sound: "<opencv_storage>\n<image_width>320</image_width>\n<image_height>240</image_height>\n\
                <camera_matrix type_id=\"opencv-matrix\">\n<rows>3</rows>\n<cols>3</cols>\n<dt>d</dt>\n\
                <data>365 0 146 0 366 115 0 0 1</data></camera_matrix>\n<distortion_coefficients type_id=\"opencv-matrix\">\n\
                <rows>5</rows>\n<cols>1</cols>\n<dt>d</dt>\n<data>-0.2 0.3 0.001 0.002 0</data></distortion_coefficients>\n\
                </opencv_storage>\n",
        command: "range --rig opencv.xml.toml pixels.csv",
        damages: &[
            ("<image_width>320</image_width>\n", "", &["`image_width` is missing"]),
            ("<rows>3", "<rows>4", &["`camera_matrix` has 9 numbers", "4 × 3"]),
            ("365 0", "nan 0", &["`camera_matrix` does not hold finite numbers"]),
            ("365 0", "1e200 0", &["`focal` is"]),
            ("0 0 1</data>", "0 0 1</dta>", &["not XML", "8:"]),
            ("</opencv_storage>", "", &["not XML"]),
        ],
    },
];
